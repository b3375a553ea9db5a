//! Advection and diffusion at one face (the right side of Eq. 1b without the pressure).
//!
//! Both are differences of fluxes through the six links to the neighbouring faces of the same
//! component. A link carries the mean of its two ends times the velocity through it: with a
//! divergence-free velocity this conserves momentum and kinetic energy.
//!
//! Legend: q velocity component, c velocity through a link, m/p minus/plus neighbour.

use glam::DVec3;

use crate::grid::{FaceVector, Layout, Mesh};

/// Constants of the tendency.
#[derive(Clone, Copy)]
pub struct Coefficients {
    half_inverse: [f64; 3],
    nu_inverse_square: [f64; 3],
    acceleration: DVec3,
}

impl Coefficients {
    /// For a mesh, kinematic viscosity [m^2/s] and body acceleration [m/s^2].
    pub fn new(mesh: &Mesh, kinematic_viscosity: f64, acceleration: DVec3) -> Coefficients {
        let h = mesh.spacing.to_array();
        Coefficients {
            half_inverse: h.map(|h| 0.5 / h),
            nu_inverse_square: h.map(|h| kinematic_viscosity / (h * h)),
            acceleration,
        }
    }

    /// -div(c q) + nu lap(q) at a face with value `q`, neighbours and link velocities `[axis][minus, plus]`.
    #[inline(always)]
    fn at_face(&self, q: f64, neighbour: [[f64; 2]; 3], link: [[f64; 2]; 3]) -> f64 {
        let mut sum = 0.0;
        for axis in 0..3 {
            let ([qm, qp], [cm, cp]) = (neighbour[axis], link[axis]);
            sum += self.nu_inverse_square[axis] * (qm + qp - 2.0 * q)
                - self.half_inverse[axis] * (cp * (q + qp) - cm * (qm + q));
        }
        sum
    }
}

/// Tendencies [m/s^2] of row (j, k): writes `out[component][i]` for i = 1..=nx.
pub fn row(c: &Coefficients, velocity: &FaceVector, j: usize, k: usize, out: [&mut [f64]; 3]) {
    let layout = velocity.x.layout();
    let n = layout.row();
    let rows = Rows { layout, velocity };
    let [out_x, out_y, out_z] = out.map(|row| &mut row[..n]);
    let g = c.acceleration;

    let (u, um, up, ub, ut) = (
        rows.x(j, k),
        rows.x(j - 1, k),
        rows.x(j + 1, k),
        rows.x(j, k - 1),
        rows.x(j, k + 1),
    );
    let (v, vm, vp, vb, vt) = (
        rows.y(j, k),
        rows.y(j - 1, k),
        rows.y(j + 1, k),
        rows.y(j, k - 1),
        rows.y(j, k + 1),
    );
    let (w, wm, wp, wb, wt) = (
        rows.z(j, k),
        rows.z(j - 1, k),
        rows.z(j + 1, k),
        rows.z(j, k - 1),
        rows.z(j, k + 1),
    );
    let (u_mt, v_pb, w_mt) = (rows.x(j - 1, k), rows.y(j + 1, k - 1), rows.z(j - 1, k + 1));
    let u_b = rows.x(j, k - 1);

    for i in 1..n - 1 {
        let neighbour = [[u[i - 1], u[i + 1]], [um[i], up[i]], [ub[i], ut[i]]];
        let link = [
            [0.5 * (u[i - 1] + u[i]), 0.5 * (u[i] + u[i + 1])],
            [0.5 * (v[i - 1] + v[i]), 0.5 * (vp[i - 1] + vp[i])],
            [0.5 * (w[i - 1] + w[i]), 0.5 * (wt[i - 1] + wt[i])],
        ];
        out_x[i] = c.at_face(u[i], neighbour, link) + g.x;
    }
    for i in 1..n - 1 {
        let neighbour = [[v[i - 1], v[i + 1]], [vm[i], vp[i]], [vb[i], vt[i]]];
        let link = [
            [0.5 * (u_mt[i] + u[i]), 0.5 * (u_mt[i + 1] + u[i + 1])],
            [0.5 * (vm[i] + v[i]), 0.5 * (v[i] + vp[i])],
            [0.5 * (wm[i] + w[i]), 0.5 * (w_mt[i] + wt[i])],
        ];
        out_y[i] = c.at_face(v[i], neighbour, link) + g.y;
    }
    for i in 1..n - 1 {
        let neighbour = [[w[i - 1], w[i + 1]], [wm[i], wp[i]], [wb[i], wt[i]]];
        let link = [
            [0.5 * (u_b[i] + u[i]), 0.5 * (u_b[i + 1] + u[i + 1])],
            [0.5 * (vb[i] + v[i]), 0.5 * (v_pb[i] + vp[i])],
            [0.5 * (wb[i] + w[i]), 0.5 * (w[i] + wt[i])],
        ];
        out_z[i] = c.at_face(w[i], neighbour, link) + g.z;
    }
}

struct Rows<'a> {
    layout: Layout,
    velocity: &'a FaceVector,
}

impl<'a> Rows<'a> {
    #[inline(always)]
    fn cut(&self, values: &'a [f64], j: usize, k: usize) -> &'a [f64] {
        let start = self.layout.index(0, j, k);
        &values[start..start + self.layout.row()]
    }
    #[inline(always)]
    fn x(&self, j: usize, k: usize) -> &'a [f64] {
        self.cut(&self.velocity.x, j, k)
    }
    #[inline(always)]
    fn y(&self, j: usize, k: usize) -> &'a [f64] {
        self.cut(&self.velocity.y, j, k)
    }
    #[inline(always)]
    fn z(&self, j: usize, k: usize) -> &'a [f64] {
        self.cut(&self.velocity.z, j, k)
    }
}
