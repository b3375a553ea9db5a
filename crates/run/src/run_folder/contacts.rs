//! Contacts of a state as rows of the table and of the VTK files.

use grainwake_formats::contacts::{ContactRow, wall_code};
use grainwake_solver::dem::Partner;
use grainwake_solver::sim::Simulation;

/// Returns the contacts at the end of the last step, ordered by grain, then partner. Contacts that
/// have ended within the step are left out.
pub(super) fn contacts(sim: &Simulation) -> Vec<ContactRow> {
    let enclosure = sim.setup().enclosure();
    let acting = sim.contacts().iter().filter(|contact| contact.overlap > 0.0);
    let rows = acting.map(|contact| {
        let centre = sim.grains()[contact.grain].pose.position;
        let (partner, partner_centre) = match contact.partner {
            Partner::Grain(other) => {
                // The image of the partner on the other side of the contact point.
                let across = sim.grains()[other].pose.position - contact.point;
                (other as i64, contact.point + enclosure.nearest_image(across))
            }
            Partner::Wall { axis, side } => (wall_code(axis, side), contact.point),
        };
        ContactRow {
            time: sim.time(),
            grain: contact.grain,
            partner,
            point: contact.point,
            normal: contact.normal,
            overlap: contact.overlap,
            force: contact.load.force,
            centre,
            partner_centre,
        }
    });
    rows.collect()
}

/// Returns the rows of `contacts.csv` for the present state.
pub(super) fn table_rows(sim: &Simulation) -> String {
    let mut text = String::new();
    contacts(sim).iter().for_each(|row| row.append_to(&mut text));
    text
}
