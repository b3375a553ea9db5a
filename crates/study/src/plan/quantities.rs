//! Names of the measured quantities and shape factors that an analysis file may refer to, and of
//! the other columns of the table of a study.

/// Quantities measured on a pair, in table order.
pub const PAIR_QUANTITIES: [&str; 22] = [
    "kiss_time",
    "kissing_stage",
    "contact_stage",
    "parted",
    "tumble_time",
    "pass_time",
    "separation_time",
    "landing_time",
    "kisses",
    "repeated",
    "role_changes",
    "closest",
    "closest_gap",
    "final_distance",
    "mean_speed_leading",
    "mean_speed_trailing",
    "peak_speed_leading",
    "peak_speed_trailing",
    "draft_speed_leading",
    "draft_speed_trailing",
    "long_axis_leading",
    "long_axis_trailing",
];

/// Quantities measured on a single grain or on three and more, in table order.
pub const SETTLING_QUANTITIES: [&str; 16] = [
    "grains",
    "landed",
    "peak_speed",
    "final_speed",
    "mean_speed",
    "speed_change",
    "peak_speed_m_per_s",
    "final_speed_m_per_s",
    "peak_reynolds",
    "final_reynolds",
    "landing_time",
    "last_landing",
    "landing_time_s",
    "drift",
    "long_axis",
    "turned",
];

/// Factors of every run: Krumbein sphericity and, if known, Wadell roundness of its first grain.
pub const SHAPE_FACTORS: [&str; 2] = ["krumbein_sphericity", "wadell_roundness"];

/// First columns of `table.csv`; axes, factors and quantities follow.
pub const FIRST_COLUMNS: [&str; 4] = ["run", "model", "member", "state"];
/// Last columns of `table.csv`.
pub const LAST_COLUMNS: &str =
    "diameter_m,kiss_time_s,steps,end_time_s,wall_s,threads,max_divergence,id,remark";

/// Returns whether `table.csv` has a column of this name in some study.
pub fn is_column(name: &str) -> bool {
    PAIR_QUANTITIES.contains(&name)
        || SETTLING_QUANTITIES.contains(&name)
        || FIRST_COLUMNS.contains(&name)
        || LAST_COLUMNS.split(',').any(|column| column == name)
}
