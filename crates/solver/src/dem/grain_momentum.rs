//! Energy and momentum of a grain, which a step does not need.

use glam::DVec3;

use super::grain::Grain;

impl Grain {
    /// Kinetic energy of translation and rotation [J].
    pub fn kinetic_energy(&self) -> f64 {
        let omega = self.pose.orientation.conjugate() * self.angular_velocity;
        0.5 * self.mass() * self.velocity.length_squared()
            + 0.5 * omega.dot(self.principal_inertia() * omega)
    }
    /// Linear momentum [kg m/s].
    pub fn momentum(&self) -> DVec3 {
        self.mass() * self.velocity
    }
    /// Angular momentum about the point `about` [kg m^2/s, space frame].
    pub fn angular_momentum(&self, about: DVec3) -> DVec3 {
        let omega = self.pose.orientation.conjugate() * self.angular_velocity;
        (self.pose.position - about).cross(self.momentum())
            + self.pose.orientation * (self.principal_inertia() * omega)
    }
}
