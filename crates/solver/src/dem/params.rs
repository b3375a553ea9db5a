//! Parameters of contact.

/// Contact law (Eqs 9-18) and its options.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactParams {
    /// Normal stiffness k_n [N/m] (Eq. 9).
    pub normal_stiffness: f64,
    /// Tangential stiffness over normal stiffness, k_zeta / k_n (Eq. 14).
    pub tangential_ratio: f64,
    /// Coulomb friction coefficient between grains (Eq. 15).
    pub friction: f64,
    /// Coulomb friction coefficient at walls.
    pub wall_friction: f64,
    /// Coefficient of restitution; 1 has no dashpot (the paper's setting).
    pub restitution: f64,
    /// Global damping constant xi [1/s] (Eqs 6, 22, 24).
    pub global_damping: f64,
    /// Lubrication correction below this gap [m]; zero turns it off (the paper's setting).
    pub lubrication_gap: f64,
    /// Sub-steps per contact time (half period of the stiffest pair).
    pub substeps_per_contact: f64,
}

impl Default for ContactParams {
    fn default() -> Self {
        ContactParams {
            normal_stiffness: 100.0,
            tangential_ratio: 2.0 / 7.0,
            friction: 0.5,
            wall_friction: 0.5,
            restitution: 1.0,
            global_damping: 0.0,
            lubrication_gap: 0.0,
            substeps_per_contact: 25.0,
        }
    }
}
