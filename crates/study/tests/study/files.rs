//! A case of a small pair without fluid, and a study of it.

/// Two spheres that fall onto the floor and each other, without fluid; runs in milliseconds.
pub const DRY: &str = r#"
title = "dry pair"
[domain]
size = ["10 mm", "10 mm", "30 mm"]
[contact]
stiffness = 200
restitution = 0.8
[time]
end = "60 ms"
step = "0.1 ms"
[output]
tables = "1 ms"
checkpoint_steps = 40
[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
nodes = 200
density = 2500
position = ["5 mm", "5 mm", "5 mm"]
[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
nodes = 200
density = 2500
position = ["5.2 mm", "5 mm"]
velocity = [0, 0, "-0.2 m/s"]
gap_above = { grain = 0, gap = "1 mm" }
"#;

/// Two axes and a model outside the axes.
pub const STUDY: &str = r#"
title = "test"
base = "case.toml"
[[axis]]
name = "weight"
key = ["grain.0.density", "grain.1.density"]
values = [
  { name = "light", value = 2000, factors = { density = 2000 } },
  { name = "heavy", value = "4 g/cm3", factors = { density = 4000 } },
]
[[axis]]
name = "grip"
values = [
  { name = "smooth", set = { "contact.friction" = 0 } },
  { name = "rough", set = { contact = { friction = 0.6, wall_friction = 0.1 } } },
]
[[model]]
name = "alone"
set = { "grain.1.velocity" = [0, 0, 0] }
[[adjust]]
models = ["heavy-*"]
set = { "time.end" = "50 ms" }
"#;
