//! Contact output: forces of resting grains, the network, contacts with walls as events.

use std::path::Path;

use crate::common::{WET, assert_same_run, folder_with, grainwake};

/// Three spheres on top of each other, without fluid.
const STACK: &str = r#"
[domain]
size = ["4 mm", "4 mm", "8 mm"]
[contact]
stiffness = 300
restitution = 0.2
[time]
end = "60 ms"
step = "0.1 ms"
[output]
tables = "10 ms"
surfaces = "20 ms"
contacts = "10 ms"
contact_network = "30 ms"
wall_events = true
checkpoint_steps = 50
[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
nodes = 600
density = 2500
position = ["2 mm", "2 mm", "1.001 mm"]
[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
nodes = 600
density = 2500
position = ["2 mm", "2 mm", "3.002 mm"]
[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
nodes = 600
density = 2500
position = ["2 mm", "2 mm", "5.003 mm"]
"#;

const LOWER_Z: i64 = -5;
const SPHERE: f64 = std::f64::consts::PI / 6.0 * 8e-9;

fn run(case: &Path, out: &Path, more: &[&str]) {
    let mut command = grainwake();
    command.arg("run").arg(case).args(["--quiet", "--no-report", "-o"]).arg(out).args(more);
    command.assert().success();
}

/// Contact of the table at its last time.
struct Row {
    grain: i64,
    partner: i64,
    point: [f64; 3],
    overlap: f64,
    force: [f64; 3],
}

fn last_contacts(run: &Path) -> Vec<Row> {
    let text = std::fs::read_to_string(run.join("contacts.csv")).unwrap();
    let (header, rows) = text.split_once('\n').unwrap();
    assert_eq!(header, "time,grain,partner,x,y,z,nx,ny,nz,overlap,fx,fy,fz");
    let rows: Vec<Vec<f64>> =
        rows.lines().map(|line| line.split(',').map(|n| n.parse().unwrap()).collect()).collect();
    let last = rows.last().expect("a contact")[0];
    let row = |r: &Vec<f64>| Row {
        grain: r[1] as i64,
        partner: r[2] as i64,
        point: [r[3], r[4], r[5]],
        overlap: r[9],
        force: [r[10], r[11], r[12]],
    };
    rows.iter().filter(|r| r[0] == last).map(row).collect()
}

/// Sum of the contact forces on each of `count` grains [N]; a partner receives the opposite force.
fn net_forces(contacts: &[Row], count: usize) -> Vec<[f64; 3]> {
    let mut net = vec![[0.0; 3]; count];
    for contact in contacts {
        for axis in 0..3 {
            net[contact.grain as usize][axis] += contact.force[axis];
            if contact.partner >= 0 {
                net[contact.partner as usize][axis] -= contact.force[axis];
            }
        }
    }
    net
}

#[test]
fn a_stack_of_three_spheres_rests_on_forces_of_one_two_and_three_weights() {
    let (folder, case) = folder_with(STACK);
    let out = folder.path().join("run");
    run(&case, &out, &[]);
    let weight = 2500.0 * SPHERE * 9.81;
    let contacts = last_contacts(&out);
    let pairs: Vec<_> = contacts.iter().map(|c| (c.grain, c.partner)).collect();
    assert_eq!(pairs, [(0, 1), (0, LOWER_Z), (1, 2)]);
    // The upper grain presses down on the lower one; the floor presses up.
    for (contact, weights) in contacts.iter().zip([-2.0, 3.0, -1.0]) {
        let [x, y, z] = contact.force;
        assert!((z / weight - weights).abs() < 2e-3, "{z} N is not {weights} weights");
        assert!(x.hypot(y) < 1e-3 * weight);
        // A linear spring of 300 N/m.
        assert!((contact.overlap * 300.0 / z.abs() - 1.0).abs() < 2e-3, "{}", contact.overlap);
    }
    assert!((contacts[0].point[2] - 2e-3).abs() < 1e-5, "{:?}", contacts[0].point);
    // Action is reaction: every grain is carried by exactly its weight.
    for net in net_forces(&contacts, 3) {
        assert!((net[2] / weight - 1.0).abs() < 2e-3, "{net:?}");
    }
    // The network is part of the collection, every 30 ms.
    let collection = std::fs::read_to_string(out.join("run.pvd")).unwrap();
    for name in ["points", "network"] {
        for count in ["000000", "000001", "000002"] {
            let file = format!("contacts/{name}_{count}.vtp");
            assert!(collection.contains(&file), "{file}");
            assert!(out.join(file).is_file());
        }
        assert!(!out.join(format!("contacts/{name}_000003.vtp")).exists());
    }
    let network = std::fs::read(out.join("contacts/network_000002.vtp")).unwrap();
    let head = String::from_utf8_lossy(&network[..1000]).into_owned();
    assert!(
        head.contains("NumberOfPoints=\"6\" NumberOfVerts=\"0\" NumberOfLines=\"3\""),
        "{head}"
    );

    // Forces and events continue over an interruption with equal bits.
    let parts = folder.path().join("parts");
    run(&case, &parts, &["--set", "time.end=30 ms"]);
    run(&case, &parts, &["--resume"]);
    assert_same_run(&out, &parts);
    let resolved = folder.path().join("resolved");
    run(&out.join("case.resolved.toml"), &resolved, &[]);
    assert_same_run(&out, &resolved);
}

#[test]
fn a_grain_at_rest_in_water_is_carried_by_its_submerged_weight() {
    let (folder, case) = folder_with(WET);
    let out = folder.path().join("run");
    let sets = [
        "--set",
        "contact.restitution=0.2",
        "--set",
        "output.contacts=5 ms",
        "--set",
        "time.end=0.15",
        "--set",
        "grain.0.position=[\"2 mm\", \"2 mm\", \"1.02 mm\"]",
        "--set",
        "grain.1.motion=\"fixed\"",
        "--set",
        "grain.1.gap_above={ grain = 0, gap = \"5 mm\" }",
    ];
    run(&case, &out, &sets);
    let contacts = last_contacts(&out);
    assert_eq!(contacts.len(), 1);
    let submerged = 1500.0 * SPHERE * 9.81;
    let net = net_forces(&contacts, 2)[0];
    assert!((net[2] / submerged - 1.0).abs() < 5e-3, "{net:?}, not {submerged}");
    assert!(net[0].hypot(net[1]) < 5e-3 * submerged, "{net:?}");
}

#[test]
fn contacts_with_walls_begin_and_end_as_events() {
    // The sphere flies upwards, bounces off the lid and comes to rest on the floor.
    let text = STACK.split("[[grain]]").take(2).collect::<Vec<_>>().join("[[grain]]");
    let (folder, case) = folder_with(&format!("{text}\nvelocity = [0, 0, 0.6]\n"));
    let out = folder.path().join("run");
    run(&case, &out, &["--set", "time.end=0.3"]);
    let events = |run: &Path| {
        let text = std::fs::read_to_string(run.join("events.jsonl")).unwrap();
        let events = text.lines().map(|line| serde_json::from_str(line).unwrap());
        events.collect::<Vec<serde_json::Value>>()
    };
    let told: Vec<(String, String)> = events(&out)
        .iter()
        .filter(|event| event["event"] != "landing")
        .map(|event| {
            (event["event"].as_str().unwrap().into(), event["wall"].as_str().unwrap().into())
        })
        .collect();
    let expected =
        [("wall-contact", "upper z"), ("wall-separation", "upper z"), ("wall-contact", "lower z")];
    assert_eq!(told, expected.map(|(kind, wall)| (kind.to_owned(), wall.to_owned())));
    let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
    assert!(summary.contains("\"wall\": \"upper z\"") || summary.contains("\"wall\":\"upper z\""));
    // Without the key there are no such events, no table and no folder.
    let without = folder.path().join("without");
    let off = ["--unset", "output.contacts", "--unset", "output.contact_network"];
    run(&case, &without, &[&off[..], &["--set", "output.wall_events=false"]].concat());
    assert!(events(&without).iter().all(|event| event["event"] == "landing"));
    assert!(!without.join("contacts.csv").exists() && !without.join("contacts").exists());
}
