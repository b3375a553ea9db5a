//! Rotation: the paper's printed matrices, the symmetric top, the Dzhanibekov effect.

use glam::{DMat3, DMat4, DQuat, DVec3, DVec4};
use grainwake_solver::dem::rotation::{
    half_step_explicit, half_step_implicit, rotate_by_cayley, rotate_exactly,
};

/// The paper's (q1, q2, q3, q4) of Eq. 31 for an orientation.
fn to_paper_quaternion(orientation: DQuat) -> [f64; 4] {
    [-orientation.y, orientation.x, orientation.z, orientation.w]
}

/// The orientation for the paper's (q1, q2, q3, q4) of Eq. 31.
fn from_paper_quaternion(q: [f64; 4]) -> DQuat {
    DQuat::from_xyzw(q[1], -q[0], q[2], q[3])
}

/// Rigid body that rotates about its centroid, without grain or contact.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rotor {
    /// Principal moments of inertia [kg m^2].
    inertia: DVec3,
    /// Orientation, body to space.
    orientation: DQuat,
    /// Angular velocity at integer time [rad/s, body frame].
    omega: DVec3,
}

impl Rotor {
    /// One step [s] with the torque [N m, space frame] that `torque` gives for an orientation.
    fn step(&mut self, step: f64, damping: f64, mut torque: impl FnMut(DQuat) -> DVec3) {
        let before = self.orientation.conjugate() * torque(self.orientation);
        let mid = half_step_explicit(self.inertia, self.omega, before, damping, 0.5 * step);
        self.orientation = rotate_by_cayley(self.orientation, mid, step);
        let after = self.orientation.conjugate() * torque(self.orientation);
        self.omega = half_step_implicit(self.inertia, mid, after, damping, 0.5 * step);
    }
    /// Kinetic energy [J].
    fn energy(&self) -> f64 {
        0.5 * self.omega.dot(self.inertia * self.omega)
    }
    /// Angular momentum [kg m^2/s, space frame].
    fn angular_momentum(&self) -> DVec3 {
        self.orientation * (self.inertia * self.omega)
    }
}

/// Eq. 30 as printed, rows first.
fn printed_a([q1, q2, q3, q4]: [f64; 4]) -> DMat3 {
    DMat3::from_cols_array(&[
        -q1 * q1 + q2 * q2 - q3 * q3 + q4 * q4,
        -2.0 * (q1 * q2 - q3 * q4),
        2.0 * (q2 * q3 + q1 * q4),
        -2.0 * (q1 * q2 + q3 * q4),
        q1 * q1 - q2 * q2 - q3 * q3 + q4 * q4,
        -2.0 * (q1 * q3 - q2 * q4),
        2.0 * (q2 * q3 - q1 * q4),
        -2.0 * (q1 * q3 + q2 * q4),
        -q1 * q1 - q2 * q2 + q3 * q3 + q4 * q4,
    ])
    .transpose()
}

/// Eq. 32 as printed.
fn printed_rates([q1, q2, q3, q4]: [f64; 4], w: DVec3) -> [f64; 4] {
    let rows = [[-q3, -q4, q2], [q4, -q3, -q1], [q1, q2, q4], [-q2, q1, -q3]];
    rows.map(|row| 0.5 * DVec3::from_array(row).dot(w))
}

/// B of Eq. 35 as printed, with beta of Eq. 36.
fn printed_b(omega: DVec3, dt: f64) -> DMat4 {
    let b = omega * (0.25 * dt);
    DMat4::from_cols_array_2d(&[
        [1.0, -b.z, b.x, b.y],
        [b.z, 1.0, b.y, -b.x],
        [-b.x, -b.y, 1.0, -b.z],
        [-b.y, b.x, b.z, 1.0],
    ])
    .transpose()
}

/// Eq. 31 as printed.
fn printed_q(phi: f64, theta: f64, psi: f64) -> [f64; 4] {
    let (s, c) = (0.5 * theta).sin_cos();
    let (minus, plus) = (0.5 * (psi - phi), 0.5 * (psi + phi));
    [s * minus.sin(), s * minus.cos(), c * plus.sin(), c * plus.cos()]
}

fn sample() -> DQuat {
    DQuat::from_scaled_axis(DVec3::new(0.7, -1.1, 0.4))
}

#[test]
fn printed_eq_30_is_a_proper_rotation_from_space_to_body() {
    let a = printed_a(to_paper_quaternion(sample()));
    assert!((a * a.transpose() - DMat3::IDENTITY).to_cols_array().iter().all(|x| x.abs() < 1e-15));
    assert!((a.determinant() - 1.0).abs() < 1e-14);
    // A is the transpose of the matrix from body to space: it maps space vectors to the body frame.
    let space_to_body = DMat3::from_quat(sample()).transpose();
    assert!(a.abs_diff_eq(space_to_body, 1e-15));
}

#[test]
fn printed_eq_31_gives_eq_30_for_the_z_x_z_angles() {
    let (phi, theta, psi) = (0.8, 1.1, -0.5);
    let a = printed_a(printed_q(phi, theta, psi));
    // Frame rotations about z, x', z'': the transposes of the vector rotations.
    let frame = DMat3::from_rotation_z(psi).transpose()
        * DMat3::from_rotation_x(theta).transpose()
        * DMat3::from_rotation_z(phi).transpose();
    assert!(a.abs_diff_eq(frame, 1e-15));
    let back = to_paper_quaternion(from_paper_quaternion(printed_q(phi, theta, psi)));
    assert_eq!(back, printed_q(phi, theta, psi));
}

#[test]
fn printed_eq_32_is_the_rate_of_eq_30_for_body_frame_rates() {
    let omega = DVec3::new(0.3, -0.8, 0.5);
    let q = to_paper_quaternion(sample());
    let rate = printed_rates(q, omega);
    let h = 1e-6;
    // Orientation rotated exactly by omega (body frame) over +-h.
    let turned = |h: f64| to_paper_quaternion(rotate_exactly(sample(), sample() * omega, h));
    let (ahead, behind) = (turned(h), turned(-h));
    for i in 0..4 {
        assert!((rate[i] - (ahead[i] - behind[i]) / (2.0 * h)).abs() < 1e-9, "component {i}");
    }
}

#[test]
fn eq_34_equals_the_cayley_turn() {
    let omega = DVec3::new(2.0, -5.0, 3.0);
    let dt = 0.05;
    let b = printed_b(omega, dt);
    let q = DVec4::from_array(to_paper_quaternion(sample()));
    let expected = b.inverse() * (b.transpose() * q);
    let cayley = DVec4::from_array(to_paper_quaternion(rotate_by_cayley(sample(), omega, dt)));
    assert!((expected - cayley).length() < 1e-15);
    assert!((expected.length() - 1.0).abs() < 1e-15);
    // The rotation is by 4 atan(|omega| dt / 4) about omega.
    let angle = 4.0 * (0.25 * omega.length() * dt).atan();
    let exact = sample() * DQuat::from_axis_angle(omega.normalize(), angle);
    assert!((exact - rotate_by_cayley(sample(), omega, dt)).length() < 1e-15);
}

#[test]
fn printed_eq_37_turns_the_torque_the_wrong_way() {
    // The body x axis points along space y. A torque about space y is about x in the body frame.
    let orientation = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
    let a = printed_a(to_paper_quaternion(orientation));
    let torque = DVec3::Y;
    assert!((a * torque - DVec3::X).length() < 1e-15, "A takes the torque to the body");
    assert!(
        (a.transpose() * torque + DVec3::X).length() < 1e-15,
        "A^T, as printed, reverses it here"
    );
}

#[test]
fn printed_eq_37_would_change_the_angular_momentum_direction() {
    // A constant torque in space must change L by torque * time; with A^T of Eq. 30 it does not.
    let torque = DVec3::new(0.2, -0.1, 0.3);
    let run = |wrong: bool| {
        let mut rotor = Rotor {
            inertia: DVec3::new(1.0, 2.0, 3.0),
            orientation: sample(),
            omega: DVec3::new(0.3, 0.2, -0.4),
        };
        let start = rotor.angular_momentum();
        for _ in 0..2000 {
            // The integrator applies A to its torque: A (A^T A^T M) = A^T M.
            rotor.step(1e-3, 0.0, |q| if wrong { q * (q * torque) } else { torque });
        }
        (rotor.angular_momentum() - start - 2.0 * torque).length() / (2.0 * torque.length())
    };
    assert!(run(false) < 1e-6, "{}", run(false));
    assert!(run(true) > 0.5, "{}", run(true));
}

#[test]
fn symmetric_top_precesses_at_the_analytic_rates() {
    // I = (1, 1, 2), omega = (0.1, 0, 1): body rate 1, space rate |L| / I1 = 2.00250.
    let mut rotor = Rotor {
        inertia: DVec3::new(1.0, 1.0, 2.0),
        orientation: sample(),
        omega: DVec3::new(0.1, 0.0, 1.0),
    };
    let momentum = rotor.angular_momentum();
    let (dt, steps) = (1e-3, 20_000);
    let axis = |r: &Rotor| r.orientation * DVec3::Z;
    let perpendicular = |v: DVec3| v - v.project_onto(momentum);
    let (mut body, mut space) = (0.0, 0.0);
    for _ in 0..steps {
        let before = rotor;
        rotor.step(dt, 0.0, |_| DVec3::ZERO);
        body += before.omega.truncate().angle_to(rotor.omega.truncate());
        let (from, to) = (perpendicular(axis(&before)), perpendicular(axis(&rotor)));
        space += from.cross(to).dot(momentum.normalize()).atan2(from.dot(to));
    }
    let time = dt * f64::from(steps);
    assert!((body / time - 1.0).abs() < 1e-5, "body rate {}", body / time);
    assert!((space / time - 2.0025).abs() < 1e-5 * 2.0025 + 5e-6, "space rate {}", space / time);
    let across = rotor.omega.truncate().length();
    assert!((across - 0.1).abs() < 1e-10, "{across}");
    assert!((rotor.angular_momentum() - momentum).length() < 1e-5 * momentum.length());
}

#[test]
fn dzhanibekov_period_within_a_thousandth() {
    let mut rotor = Rotor {
        inertia: DVec3::new(1.0, 2.0, 3.0),
        orientation: DQuat::IDENTITY,
        omega: DVec3::new(0.01, 1.0, 0.01),
    };
    let dt = 2e-3;
    let mut crossings = Vec::new();
    let mut time = 0.0;
    while crossings.len() < 5 {
        let before = rotor.omega.y;
        rotor.step(dt, 0.0, |_| DVec3::ZERO);
        if before * rotor.omega.y <= 0.0 {
            crossings.push(time + dt * before / (before - rotor.omega.y));
        }
        time += dt;
    }
    let first: f64 = crossings[0];
    assert!((first - 10.9170).abs() < 1e-3 * 10.917, "first change of sign {first}");
    for pair in crossings.windows(3) {
        let period = pair[2] - pair[0];
        assert!((period - 39.105734).abs() < 1e-3 * 39.105734, "period {period}");
    }
}

#[test]
fn a_million_free_steps_keep_energy_momentum_and_norm() {
    let mut rotor = Rotor {
        inertia: DVec3::new(1.0, 2.0, 3.0),
        orientation: sample(),
        omega: DVec3::new(0.5, 1.0, -0.7),
    };
    let (energy, momentum) = (rotor.energy(), rotor.angular_momentum());
    let mut worst: f64 = 0.0;
    for _ in 0..1_000_000 {
        rotor.step(1e-3, 0.0, |_| DVec3::ZERO);
        worst = worst.max((rotor.energy() / energy - 1.0).abs());
        assert!((rotor.orientation.length() - 1.0).abs() < 1e-14);
    }
    let spin = (rotor.inertia * rotor.omega).length() / momentum.length() - 1.0;
    let direction = (rotor.angular_momentum() - momentum).length() / momentum.length();
    println!("energy {worst:.2e}, |L| {spin:.2e}, L {direction:.2e}");
    assert!(worst <= 1e-6, "energy drift {worst}");
    assert!(spin.abs() <= 1e-6, "|L| {spin}");
    assert!(direction <= 1e-4, "L in space {direction}");
}

#[test]
fn order_of_the_rotation_is_two() {
    let end = |steps: u32| {
        let mut rotor = Rotor {
            inertia: DVec3::new(1.0, 2.0, 3.0),
            orientation: sample(),
            omega: DVec3::new(0.5, 1.0, -0.7),
        };
        for _ in 0..steps {
            rotor.step(4.0 / f64::from(steps), 0.0, |q| q * DVec3::new(0.1, 0.2, 0.0));
        }
        rotor
    };
    let fine = end(12_800);
    let error = |steps| {
        let r = end(steps);
        (r.orientation - fine.orientation).length() + (r.omega - fine.omega).length()
    };
    let order = (error(100) / error(200)).log2();
    assert!((order - 2.0).abs() < 0.1, "order {order}");
}

#[test]
fn damped_spin_decays_as_an_exponential() {
    let mut rotor = Rotor {
        inertia: DVec3::new(1.0, 2.0, 3.0),
        orientation: sample(),
        omega: DVec3::new(0.0, 0.0, 2.0),
    };
    for _ in 0..1000 {
        rotor.step(1e-3, 1.5, |_| DVec3::ZERO);
    }
    let expected = 2.0 * (-1.5f64).exp();
    assert!((rotor.omega.z / expected - 1.0).abs() < 1e-6, "{}", rotor.omega.z / expected);
}
