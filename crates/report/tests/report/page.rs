//! Reports of made-up runs: what is drawn, what is said, and what happens to damaged folders.

use std::path::Path;

use grainwake_formats::FormatError;
use grainwake_plot::style;
use grainwake_report::features::RunFeatures;
use grainwake_report::run_folder::RunFolder;
use grainwake_report::{ReportError, ReportFiles, render};

use crate::synthetic::{flows, fresh, heap, pair, surfaces};

fn names(rendered: &ReportFiles) -> Vec<String> {
    let stem = |file: &std::path::PathBuf| file.file_stem().unwrap().to_string_lossy().into_owned();
    rendered.png.iter().map(stem).collect()
}

fn page(rendered: &ReportFiles) -> String {
    std::fs::read_to_string(&rendered.page).unwrap()
}

fn svg(rendered: &ReportFiles, name: &str) -> String {
    let file = rendered.svg.iter().find(|file| file.file_stem().unwrap() == name).expect(name);
    std::fs::read_to_string(file).unwrap()
}

/// Text of an SVG as a reader sees it.
fn text_of(svg: &str) -> String {
    let document = roxmltree::Document::parse(svg).unwrap();
    let texts = document.descendants().filter(|node| node.is_text());
    texts.filter_map(|node| node.text()).collect::<Vec<_>>().join("")
}

/// Width, and share of pixels that are not white.
fn picture(file: &Path) -> (u32, f64) {
    let bytes = std::fs::read(file).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut data = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut data).unwrap();
    let inked = data.chunks_exact(3).filter(|p| p.iter().any(|v| *v < 250)).count();
    (info.width, inked as f64 / (info.width * info.height) as f64)
}

/// Changes the cells of each row of `grains.csv`.
fn edit_rows(folder: &Path, edit: impl Fn(&mut [String])) {
    let file = folder.join("grains.csv");
    let table = std::fs::read_to_string(&file).unwrap();
    let edited = |line: &str| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if cells[0] != "time" {
            edit(&mut cells);
        }
        cells.join(",") + "\n"
    };
    std::fs::write(&file, table.lines().map(edited).collect::<String>()).unwrap();
}

/// Replaces a part of a file of a run, which it must hold.
fn replace(folder: &Path, name: &str, from: &str, to: &str) {
    let text = std::fs::read_to_string(folder.join(name)).unwrap();
    assert!(text.contains(from), "{name} lacks {from}: {text}");
    std::fs::write(folder.join(name), text.replace(from, to)).unwrap();
}

fn small_pair(swing: f64) -> std::path::PathBuf {
    let folder = fresh::folder("pair");
    pair::pair(&folder, swing, 0.5e-3);
    folder
}

fn remove(folder: &Path) {
    std::fs::remove_dir_all(folder.parent().unwrap()).unwrap();
}

#[test]
fn a_pair_gets_all_its_figures() {
    let folder = small_pair(0.9);
    let rendered = render(&folder).unwrap();
    let expected =
        ["trajectories", "gap", "velocity", "orientation", "speed", "vorticity", "diagnostics"];
    assert_eq!(names(&rendered), expected);
    assert!(rendered.finished && rendered.notes.is_empty(), "{:?}", rendered.notes);
    for file in &rendered.png {
        let (width, ink) = picture(file);
        assert!(width >= 1000, "{} is {width} pixels wide", file.display());
        assert!((0.02..0.98).contains(&ink), "{}: {ink} of it is inked", file.display());
    }
    for (name, texts) in [
        (
            "trajectories",
            vec!["x  [mm]", "y  [mm]", "z  [mm]", "(a)", "(d)", "grain 0 (trailing at the start)"],
        ),
        (
            "gap",
            vec![
                "distance / d  [–]",
                "t √(g/d)  [–]",
                "kiss",
                "tumbling",
                "role change",
                "separation",
                "landing",
            ],
        ),
        ("velocity", vec!["vz / √(d g)  [–]", "grain 1 (leading at the start)"]),
        ("orientation", vec!["long axis  [°]", "short axis  [°]", "|ω| √(d/g)  [–]"]),
        (
            "speed",
            vec!["speed |u|  [m/s]", "0.1 m/s", "plane of grain 0", "(b) kiss", "t √(g/d) = 17.9"],
        ),
        ("vorticity", vec!["vorticity ωy  [1/s]", "(c) role change"]),
        ("diagnostics", vec!["max |div u|  [1/s]", "CFL  [–]", "energy  [10−9 J]"]),
    ] {
        let seen = text_of(&svg(&rendered, name));
        for text in texts {
            assert!(seen.contains(text), "{name} lacks '{text}': {seen}");
        }
    }
    let images = svg(&rendered, "speed").matches("<image").count();
    assert_eq!(images, 8 + 1, "a row for the plane of each grain, and the colour bar");
    remove(&folder);
}

#[test]
fn the_page_tells_of_the_refined_box_and_the_contact_law() {
    let folder = fresh::folder("refined");
    pair::pair(&folder, 0.0, 1e-3);
    let file = folder.join("case.resolved.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let refined = text.replace("[domain]\n", "[domain]\nrefinement = 2\n")
        + "[contact]\nstiffness = 649.39\nfriction = 0.5\nlubrication_gap = 2e-4\nglobal_damping = 0.0\n";
    std::fs::write(&file, refined).unwrap();
    let page = page(&render(&folder).unwrap());
    assert!(page.contains("refined box around the grains") && page.contains("/2, "), "{page}");
    let contact = "linear, stiffness 649 N/m, friction 0.500, lubrication below 0.200 mm";
    assert!(page.contains(contact) && !page.contains("global damping"));
    remove(&folder);
}

#[test]
fn the_upper_grain_leads_a_pair_that_rises() {
    let folder = fresh::folder("rising");
    pair::pair(&folder, 0.0, 1e-3);
    let pair = || RunFeatures::of(&RunFolder::open(&folder).unwrap()).pair.unwrap();
    let sinking = pair();
    std::fs::remove_dir_all(folder.join("slices")).unwrap();
    // Height on paper of the tilt at the start; y points down.
    let tilt_at_start = || {
        let gap = svg(&render(&folder).unwrap(), "gap");
        let document = roxmltree::Document::parse(&gap).unwrap();
        let mut nodes = document.descendants();
        let curve = nodes.find(|node| node.attribute("stroke") == Some(style::GREEN)).unwrap();
        let start = curve.attribute("d").unwrap().trim_start_matches('M').split('L').next();
        start.unwrap().split(' ').nth(1).unwrap().parse::<f64>().unwrap()
    };
    let in_line = tilt_at_start();
    for name in ["case.resolved.toml", "summary.json"] {
        let text = std::fs::read_to_string(folder.join(name)).unwrap();
        std::fs::write(folder.join(name), text.replace("1500.0", "500.0")).unwrap();
    }
    let [trailing, leading] = pair();
    assert_eq!([leading, trailing], sinking);
    assert_eq!(tilt_at_start(), in_line, "one behind the other is 0° for both");
    remove(&folder);
}

/// Whether this place of the page lies inside base64 data.
fn in_picture(page: &str, at: usize) -> bool {
    let plain = |c: char| !(c.is_ascii_alphanumeric() || "+/=".contains(c));
    page[..at].rfind(plain).is_some_and(|start| page[..start].ends_with(";base64"))
}

#[test]
fn the_page_stands_alone_and_can_be_read_aloud() {
    let folder = small_pair(0.0);
    let rendered = render(&folder).unwrap();
    let images = svg(&rendered, "speed").matches("<image").count();
    assert_eq!(images, 4 + 1, "one row while the grains share a plane, and the colour bar");
    let page = page(&rendered);
    assert!(page.len() < 5_000_000, "{} bytes", page.len());
    for forbidden in ["<script", "<link", "@import", "src=", "url(http", "NaN", "inf "] {
        // Letters of an embedded picture spell anything.
        let around = page.match_indices(forbidden).find(|(at, _)| !in_picture(&page, *at));
        let around =
            around.map(|(at, _)| page.get(at.saturating_sub(60)..at + 20).unwrap_or("here"));
        assert_eq!(around, None, "the page holds '{forbidden}'");
    }
    let outside =
        page.match_indices("http").filter(|(at, _)| !page[*at..].starts_with("http://www.w3.org/"));
    assert_eq!(outside.count(), 0, "the page points outside");
    assert_eq!(page.matches("<svg").count(), 7);
    assert_eq!(
        page.matches("<title id=").count(),
        7,
        "every figure has a name for readers of the screen"
    );
    assert!(page.contains("aria-label=\"Phases: drafting from 0 s to 0.256 s; kissing from"));
    for text in [
        "Galileo number",
        "198",
        "1.50",
        "4.00",
        "Reynolds number",
        "0123abc",
        "predict 16 min 40 s, output 2.00 s",
        "20 min 34 s",
        "role change",
        "session 1, command",
        "prefers-color-scheme: dark",
        "@media print",
    ] {
        assert!(page.contains(text), "the page lacks '{text}'");
    }
    let ids: Vec<&str> = page
        .match_indices(" id=\"")
        .map(|(at, _)| page[at + 5..].split('"').next().unwrap())
        .collect();
    let mut unique = ids.clone();
    unique.sort_unstable();
    unique.dedup();
    assert_eq!(unique.len(), ids.len(), "ids are unique: {ids:?}");
    remove(&folder);
}

#[test]
fn the_same_folder_gives_the_same_bytes() {
    let folder = small_pair(0.9);
    let read = |rendered: &ReportFiles| -> Vec<Vec<u8>> {
        let files = rendered.png.iter().chain(&rendered.svg).chain([&rendered.page]);
        files.map(|file| std::fs::read(file).unwrap()).collect()
    };
    let first = read(&render(&folder).unwrap());
    assert!(first == read(&render(&folder).unwrap()));
    remove(&folder);
}

#[test]
fn an_interrupted_run_still_gets_a_report() {
    let folder = small_pair(0.9);
    for name in ["summary.json", "run.pvd", "provenance.json", "diagnostics.csv"] {
        std::fs::remove_file(folder.join(name)).unwrap();
    }
    let table = std::fs::read_to_string(folder.join("grains.csv")).unwrap();
    std::fs::write(folder.join("grains.csv"), &table[..table.len() / 2]).unwrap();
    let log = std::fs::read_to_string(folder.join("events.jsonl")).unwrap();
    std::fs::write(folder.join("events.jsonl"), &log[..log.len() / 5 + 20]).unwrap();
    // The writer was stopped within a slice.
    let slice = folder.join("slices/y-grain1_000179.vti");
    let bytes = std::fs::read(&slice).unwrap();
    std::fs::write(&slice, &bytes[..bytes.len() / 2]).unwrap();
    let failure = "{\"time\": 0.4, \"what\": \"CFL <9\", \"remedy\": \"a smaller step\"}";
    std::fs::write(folder.join("failure.json"), failure).unwrap();
    let failed = page(&render(&folder).unwrap());
    assert!(failed.contains("This run failed</b>: CFL &lt;9. To try: a smaller step."));
    std::fs::remove_file(folder.join("failure.json")).unwrap();
    let rendered = render(&folder).unwrap();
    assert!(!rendered.finished);
    let page = page(&rendered);
    assert!(page.contains("This run has not finished"));
    assert!(page.contains("Galileo number"), "diameters are found from the surfaces");
    for text in [
        "grains.csv: the last line",
        "events.jsonl: the last line",
        "diagnostics.csv is missing",
        "slices/y-grain1_000179.vti was left out",
    ] {
        assert!(
            rendered.notes.iter().any(|note| note.contains(text)),
            "no note '{text}' in {:?}",
            rendered.notes
        );
    }
    assert!(
        names(&rendered).contains(&"speed".to_owned())
            && names(&rendered).contains(&"gap".to_owned())
    );
    remove(&folder);
}

#[test]
fn pictures_may_be_missing_but_tables_may_not_be_damaged() {
    let folder = small_pair(0.9);
    std::fs::remove_dir_all(folder.join("slices")).unwrap();
    std::fs::remove_dir_all(folder.join("grains")).unwrap();
    let rendered = render(&folder).unwrap();
    assert_eq!(names(&rendered), ["trajectories", "gap", "velocity", "orientation", "diagnostics"]);
    assert!(page(&rendered).contains("circles of equal volume"));
    assert!(rendered.notes.iter().any(|note| note.contains("no slices")), "{:?}", rendered.notes);
    std::fs::remove_file(&rendered.page).unwrap();

    let table = std::fs::read_to_string(folder.join("grains.csv")).unwrap();
    std::fs::write(folder.join("grains.csv"), table.replacen(",0.0125,", ",0.01.25,", 1)).unwrap();
    let error = render(&folder).unwrap_err();
    assert!(matches!(&error, ReportError::Format(FormatError::Line { line: 2, .. })), "{error}");
    assert!(error.to_string().contains("'0.01.25' under 'x' is not a number"), "{error}");
    assert!(!error.is_input_output() && !folder.join("report.html").exists());
    remove(&folder);
}

#[test]
fn damage_to_any_file_is_an_error_or_a_note() {
    let folder = small_pair(0.9);
    let damage = [
        ("case.resolved.toml", "[domain\nsize = 3\n", "case.resolved.toml, line 1"),
        ("summary.json", "{\"steps\": 12", "summary.json, line 1"),
        ("provenance.json", "[1,", "provenance.json, line 1"),
        (
            "diagnostics.csv",
            "time,cfl\n0,1,2\n",
            "diagnostics.csv, line 2: 3 values under 2 columns",
        ),
        (
            "events.jsonl",
            "{\"time\":\"now\",\"event\":\"kiss\"}\n",
            "events.jsonl, line 1: invalid type",
        ),
    ];
    for (name, content, message) in damage {
        let whole = std::fs::read(folder.join(name)).unwrap();
        std::fs::write(folder.join(name), content).unwrap();
        let error = render(&folder).unwrap_err().to_string();
        assert!(error.contains(message), "{name}: {error}");
        std::fs::write(folder.join(name), whole).unwrap();
    }
    std::fs::write(folder.join("run.pvd"), "<VTKFile").unwrap();
    let rendered = render(&folder).unwrap();
    assert!(rendered.notes.iter().any(|note| note.contains("run.pvd could not be read")));
    assert!(names(&rendered).contains(&"speed".to_owned()), "times are found inside the slices");
    remove(&folder);
}

#[test]
fn empty_tables_and_strange_numbers_do_not_panic() {
    let folder = small_pair(0.9);
    std::fs::remove_dir_all(folder.join("slices")).unwrap();
    let header = std::fs::read_to_string(folder.join("grains.csv"))
        .unwrap()
        .lines()
        .next()
        .unwrap()
        .to_owned()
        + "\n";
    let rest = "1,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0";
    for (grains, diagnostics) in [
        (header.clone(), "time,cfl\n".to_owned()),
        (format!("{header}0,0,0,0,0,{rest}\n"), "time,cfl\n0,NaN\n".to_owned()),
        (
            format!("{header}0,0,1e300,0,0,{rest}\n0,1,-1e300,0,0,{rest}\n"),
            "time,cfl\n-5,inf\n1e300,1e300\n".to_owned(),
        ),
        (format!("{header}0,1,0,0,0,{rest}\n2,1,0,0,0,{rest}\n"), "cfl\n1\n".to_owned()),
    ] {
        std::fs::write(folder.join("grains.csv"), grains).unwrap();
        std::fs::write(folder.join("diagnostics.csv"), diagnostics).unwrap();
        let rendered = render(&folder).unwrap();
        assert!(page(&rendered).ends_with("</html>\n"));
    }
    remove(&folder);
}

/// `inf` and `nan` are numbers of TOML.
#[test]
fn absurd_numbers_in_the_case_do_not_panic() {
    let folder = small_pair(0.9);
    std::fs::remove_dir_all(folder.join("slices")).unwrap();
    let resolved = folder.join("case.resolved.toml");
    let sound = std::fs::read_to_string(&resolved).unwrap();
    assert!(names(&render(&folder).unwrap()).contains(&"trajectories".to_owned()));
    let [size, origin] = ["size = [0.025, 0.025, 0.0975]", "origin = [0.0, 0.0, 0.0]"];
    for (from, to) in [
        (size, "size = [inf, inf, inf]"),
        (size, "size = [0.025, 0.025, inf]"),
        (size, "size = [inf, 0.025, 0.0975]"),
        (size, "size = [1e308, 1e308, 1e308]"),
        (origin, "origin = [nan, nan, nan]"),
        (origin, "origin = [0.0, 0.0, inf]"),
        (origin, "origin = [1e300, 1e300, 1e300]"),
    ] {
        replace(&folder, "case.resolved.toml", from, to);
        let rendered = render(&folder).unwrap();
        assert!(page(&rendered).ends_with("</html>\n"), "{to}");
        std::fs::write(&resolved, &sound).unwrap();
    }
    remove(&folder);
}

#[test]
fn other_runs_get_their_own_figures() {
    let folder = fresh::folder("single");
    flows::single(&folder);
    let rendered = render(&folder).unwrap();
    assert_eq!(
        names(&rendered),
        ["trajectories", "velocity", "speed", "vorticity", "diagnostics"],
        "a sphere that does not turn has no orientation to show"
    );
    let seen = text_of(&svg(&rendered, "velocity"));
    assert!(
        seen.contains("vz  [m/s]") && seen.contains("Re = |v| d/ν  [–]") && seen.contains("t  [s]"),
        "{seen}"
    );
    assert!(page(&rendered).contains("The grain reached 0.0998 m/s downwards"));
    assert!(page(&rendered).contains("through the grain: (a) <i>t</i> = 0.325 s; (b) <i>t</i> ="));
    remove(&folder);

    let folder = fresh::folder("cavity");
    flows::cavity(&folder);
    let rendered = render(&folder).unwrap();
    assert_eq!(names(&rendered), ["speed", "vorticity", "diagnostics"]);
    assert!(page(&rendered).contains("wall below, wall (moving) above"));
    remove(&folder);

    let folder = fresh::folder("heap");
    heap::heap(&folder, 30, true);
    let rendered = render(&folder).unwrap();
    assert_eq!(names(&rendered), ["positions", "history", "diagnostics"]);
    let seen = text_of(&svg(&rendered, "positions"));
    assert!(seen.contains("height of the centre  [mm]"), "{seen}");
    assert!(page(&rendered).contains("30 grains</th><td>rock.grain, "));
    let outlines =
        |rendered: &ReportFiles| svg(rendered, "positions").matches("stroke=\"#ffffff\"").count();
    assert_eq!(outlines(&rendered), 2 * 30);
    // In a narrow periodic box some grains lie across a side: their images are at the other one,
    // unless others hide them.
    let case = folder.join("case.resolved.toml");
    let text = std::fs::read_to_string(&case).unwrap();
    let narrow = "size = [0.02, 0.04, 0.1]\ncells = [10, 20, 50]\n[domain.boundaries]\n\
                  x = [\"periodic\", \"periodic\"]\ny = [\"wall\", \"wall\"]\n\
                  z = [\"wall\", \"wall\"]";
    let text = text.replace("size = [0.04, 0.04, 0.1]\ncells = [20, 20, 50]", narrow);
    std::fs::write(&case, text).unwrap();
    let images = outlines(&render(&folder).unwrap()) - 2 * 30;
    assert!(images >= 2, "{images}");
    // Grains behind others are left out.
    heap::heap(&folder, 300, true);
    let drawn = outlines(&render(&folder).unwrap());
    assert!((100..600).contains(&drawn), "{drawn} outlines of 600");
    remove(&folder);
}

#[test]
fn few_grains_are_shown_one_by_one() {
    let folder = fresh::folder("few");
    heap::heap(&folder, 12, true);
    let rendered = render(&folder).unwrap();
    assert_eq!(names(&rendered), ["positions", "trajectories", "grains", "history", "diagnostics"]);
    let seen = text_of(&svg(&rendered, "grains"));
    for grain in 0..12 {
        assert!(seen.contains(&format!("grain {grain}")), "{seen}");
    }
    assert!(seen.contains("height  [mm]") && seen.contains("vz  [m/s]"));
    assert!(svg(&rendered, "grains").contains("stroke-dasharray"));
    let said = page(&rendered);
    assert!(said.contains("true outlines") && !said.contains("left the box"));
    assert!(!said.contains("indices of their grains"), "there are no events");
    // Events name their grains.
    let events = "{\"time\":0.1,\"event\":\"kiss\",\"grains\":[0,2],\"confirmed\":0.1}\n\
                  {\"time\":0.3,\"event\":\"landing\",\"grains\":[3],\"confirmed\":0.3}\n\
                  {\"time\":0.45,\"event\":\"landing\",\"grains\":[11],\"confirmed\":0.45}\n";
    std::fs::write(folder.join("events.jsonl"), events).unwrap();
    let rendered = render(&folder).unwrap();
    let seen = text_of(&svg(&rendered, "grains"));
    for name in ["kiss 0, 2", "landing 3", "landing 11"] {
        assert!(seen.contains(name), "{name} in {seen}");
    }
    assert!(page(&rendered).contains("Events are named with the indices of their grains"));
    // A grain that falls out of the box is not claimed to be drawn.
    edit_rows(&folder, |cells| {
        if cells[1] == "7" && cells[0].parse::<f64>().unwrap() > 0.3 {
            cells[4] = "-0.05".into();
        }
    });
    assert!(page(&render(&folder).unwrap()).contains("Grain 7 has left the box"));
    remove(&folder);
}

#[test]
fn round_off_is_not_a_turn_and_the_summary_knows_all_steps() {
    let folder = small_pair(0.9);
    edit_rows(&folder, |cells| cells[12..15].fill("3e-18".into()));
    let summary = folder.join("summary.json");
    let mut value: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&summary).unwrap()).unwrap();
    (value["max_divergence"], value["max_cfl"]) = (4.56e-9.into(), 0.789.into());
    std::fs::write(&summary, value.to_string()).unwrap();
    let rendered = render(&folder).unwrap();
    let seen = text_of(&svg(&rendered, "orientation"));
    assert!(seen.contains("long axis  [°]") && !seen.contains("ω"), "{seen}");
    let said = page(&rendered);
    assert!(said.contains("at most 0.789 in any step"), "{said}");
    assert!(said.matches("4.56×10<sup>−9</sup>").count() >= 2);
    let tilt = text_of(&svg(&rendered, "gap"));
    assert!(tilt.contains("45") && tilt.contains("135"), "{tilt}");
    remove(&folder);
}

/// Replaces the log of a run by these events at dimensionless times.
fn write_log(folder: &Path, events: &[(f64, &str)]) {
    let unit = (surfaces::D / pair::G).sqrt();
    let line = |(s, name): &(f64, &str)| {
        let time = s * unit;
        format!("{{\"time\":{time},\"event\":\"{name}\",\"grains\":[0,1],\"confirmed\":{time}}}\n")
    };
    let log: String = events.iter().map(line).collect();
    std::fs::write(folder.join("events.jsonl"), log).unwrap();
}

/// Returns the text of the page and of the figure of the gap for a pair with the given events.
fn report(events: &[(f64, &str)]) -> (String, String) {
    let folder = small_pair(0.9);
    std::fs::remove_dir_all(folder.join("slices")).unwrap();
    let summary = folder.join("summary.json");
    let mut value: serde_json::Value =
        serde_json::from_slice(&std::fs::read(&summary).unwrap()).unwrap();
    value.as_object_mut().unwrap().remove("tumble_time_s");
    std::fs::write(&summary, value.to_string()).unwrap();
    write_log(&folder, events);
    let rendered = render(&folder).unwrap();
    let out = (page(&rendered), text_of(&svg(&rendered, "gap")));
    remove(&folder);
    out
}

#[test]
fn headline_and_figures_agree_on_kiss_and_separation() {
    let (page, gap) = report(&[(5.0, "landing"), (7.94, "kiss"), (8.1, "separation")]);
    assert!(!page.contains("did not touch"));
    assert!(page.contains("The two grains kissed at"));
    let late = ", after the first has landed";
    assert!(page.matches(late).count() >= 4, "headline and caption");
    assert!(gap.contains(&format!("First contact at t √(g/d) = 7.94{late}.")));
    assert!(gap.contains(&format!("Separation at t √(g/d) = 8.10{late}.")));

    let bounce = [
        (13.2, "kiss"),
        (13.6, "separation"),
        (14.0, "kiss"),
        (17.3, "separation"),
        (44.0, "landing"),
    ];
    let (page, gap) = report(&bounce);
    assert!(gap.contains("Separation at t √(g/d) = 17.3."), "{gap}");
    let parted = page.split(", and separated at ").nth(1).unwrap();
    assert!(parted.split(". ").next().unwrap().ends_with("= 17.3"));
    assert!(!page.contains(late));
}

#[test]
fn a_tumble_after_the_separation_is_an_event_and_no_phase() {
    let (page, _) =
        report(&[(13.2, "kiss"), (13.6, "separation"), (13.8, "tumble"), (44.0, "landing")]);
    let spoken = page.split("aria-label=\"Phases: ").nth(1).unwrap();
    let phases: Vec<&str> = spoken
        .split('"')
        .next()
        .unwrap()
        .split("; ")
        .filter_map(|phase| phase.split(' ').next())
        .collect();
    assert_eq!(phases, ["drafting", "kissing", "separated", "landed"]);
    let lead = page.split("<p class=\"lead\">").nth(1).unwrap();
    let [parted, tumbled] = ["separated at", "tumbled at"].map(|text| lead.find(text).unwrap());
    assert!(parted < tumbled);
}

#[test]
fn grains_are_named_by_number_and_fields_by_precision() {
    let folder = small_pair(0.9);
    let file = folder.join("case.resolved.toml");
    let case = std::fs::read_to_string(&file).unwrap();
    let said = page(&render(&folder).unwrap());
    assert!(said.contains("2 grains</th><td>rock.grain, ") && !said.contains("single precision"));
    let changed = case.replacen("rock.grain", "shapes/e.grain", 1) + "[run]\nprecision = \"f32\"\n";
    std::fs::write(&file, changed).unwrap();
    let said = page(&render(&folder).unwrap());
    assert!(said.contains("grain 0</th><td>shapes/e.grain, "));
    assert!(said.contains("grain 1</th><td>rock.grain, "));
    assert!(said.contains("single precision"));
    remove(&folder);
}

#[test]
fn grains_that_do_not_turn_have_no_angular_speed() {
    let folder = small_pair(0.9);
    edit_rows(&folder, |cells| cells[12..15].fill("0".into()));
    let seen = text_of(&svg(&render(&folder).unwrap(), "orientation"));
    assert!(seen.contains("long axis  [°]") && !seen.contains("ω"), "{seen}");
    remove(&folder);
}

#[test]
fn a_grain_that_moves_sideways_shows_its_horizontal_speed() {
    let folder = fresh::folder("single");
    flows::single(&folder);
    // The velocity is turned to x, with round-off along z.
    edit_rows(&folder, |cells| cells[5] = std::mem::replace(&mut cells[7], "1e-12".into()));
    let seen = text_of(&svg(&render(&folder).unwrap(), "velocity"));
    assert!(seen.contains("|vh|  [m/s]") && !seen.contains("vz"), "{seen}");
    remove(&folder);
}

#[test]
fn gravity_along_a_positive_axis_is_shown_downwards() {
    let folder = fresh::folder("single");
    flows::single(&folder);
    let ends = || {
        // The path of the centre: the last line of many points of the figure.
        let svg = svg(&render(&folder).unwrap(), "trajectories");
        let path = svg.split(" d=\"").skip(1).max_by_key(|path| path.len()).unwrap();
        let path = path.split('"').next().unwrap();
        let place = |point: &str| point.split(' ').nth(1).unwrap().parse::<f64>().unwrap();
        let mut points = path.split('L').map(place);
        (points.next().unwrap(), points.next_back().unwrap())
    };
    let (start, end) = ends();
    assert!(start < end, "the grain moves along -z, which is down");
    replace(&folder, "case.resolved.toml", "[0, 0, -9.81]", "[0, 0, 9.81]");
    let (start, end) = ends();
    assert!(start > end, "now -z is up");
    let rendered = render(&folder).unwrap();
    let shown = "Gravity acts along +z, shown downwards.";
    for (name, words) in [
        ("trajectories", shown),
        ("speed", shown),
        ("vorticity", shown),
        ("velocity", "Vertical velocity (down, along +z, is negative)"),
        ("velocity", "−vz  [m/s]"),
    ] {
        let said = text_of(&svg(&rendered, name));
        assert!(said.contains(words), "{name}: {said}");
    }
    remove(&folder);
}

/// Reverses the vertical velocity before `end` [s]; the rows after it are those of a rebound.
fn rise(folder: &Path, end: f64) {
    edit_rows(folder, |cells| {
        let factor = if cells[0].parse::<f64>().unwrap() < end { -1.0 } else { 0.3 };
        cells[7] = (factor * cells[7].parse::<f64>().unwrap()).to_string();
    });
}

#[test]
fn the_largest_speed_has_its_direction() {
    let folder = fresh::folder("single");
    flows::single(&folder);
    rise(&folder, 1.29);
    let said = page(&render(&folder).unwrap());
    assert!(said.contains("The grain reached 0.0998 m/s upwards. "), "{said}");
    replace(&folder, "case.resolved.toml", "gravity = [0, 0, -9.81]\n", "gravity = [0, 0, 0]\n");
    let said = page(&render(&folder).unwrap());
    assert!(said.contains("0.0998 m/s in the direction (0.00, 0.00, 1.00). "), "{said}");
    assert!(said.contains("Velocity along z; the largest is 0.0998 m/s") && !said.contains("down"));
    // A speed that is round-off is not reported.
    edit_rows(&folder, |cells| cells[5..8].fill("3e-11".into()));
    let said = page(&render(&folder).unwrap());
    assert!(!said.contains("The grain reached") && !said.contains("Reynolds number at"), "{said}");
    remove(&folder);
}

#[test]
fn the_velocities_of_a_pair_that_rises_are_positive() {
    let folder = small_pair(0.0);
    std::fs::remove_dir_all(folder.join("slices")).unwrap();
    let peaks = || {
        let said = text_of(&svg(&render(&folder).unwrap(), "velocity"));
        let texts = said.split("at the start reaches ").nth(1).unwrap();
        texts.split(". (b)").next().unwrap().to_owned()
    };
    let settling = peaks();
    assert_eq!(settling.matches('−').count(), 2, "{settling}");
    rise(&folder, f64::INFINITY);
    assert_eq!(peaks(), settling.replace('−', ""));
    remove(&folder);
}

#[test]
fn a_dry_run_has_no_rows_about_the_grid() {
    let folder = fresh::folder("dry");
    heap::heap(&folder, 3, false);
    let rendered = render(&folder).unwrap();
    let said = page(&rendered);
    for name in ["cells", "cell edge", "cells per diameter", "coupling", "divergence"] {
        assert!(!said.contains(&format!("row\">{name}")), "{name}: {said}");
    }
    assert!(!said.contains("largest divergence"), "{said}");
    let seen = text_of(&svg(&rendered, "diagnostics"));
    assert!(seen.contains("Kinetic energy of the grains.") && !seen.contains("(a)"), "{seen}");
    remove(&folder);
}

#[test]
fn the_reynolds_number_is_relative_to_the_inflow() {
    let folder = fresh::folder("stream");
    flows::single(&folder);
    edit_rows(&folder, |cells| cells[5..8].fill("0".into()));
    assert!(!page(&render(&folder).unwrap()).contains("Reynolds number at"), "nothing moves");
    let inflow = "z = [{ kind = \"inflow\", velocity = [0.0, 0.0, 0.02] }, \"outflow\"]";
    replace(&folder, "case.resolved.toml", "z = [\"wall\", \"free-surface\"]", inflow);
    let said = page(&render(&folder).unwrap());
    let name = "Reynolds number at the largest speed relative to the inflow, \
                |<i>v</i> − <i>U</i>| <i>d</i> / <i>ν</i>";
    // 0.02 m/s * 0.015 m / (0.058 / 960 m2/s)
    assert!(said.contains(&format!("{name}</th><td>4.97</td>")), "{said}");
    assert!(said.contains("inflow below, outflow above"));
    remove(&folder);
}

/// Returns the heights of the letters (a), (b) ... in a drawing, and its last frame.
fn letters_and_frame(svg: &str) -> (Vec<f64>, [f64; 2]) {
    let document = roxmltree::Document::parse(svg).unwrap();
    let number = |node: &roxmltree::Node, name: &str| -> f64 {
        node.attribute(name).unwrap().parse().unwrap()
    };
    let texts = document.descendants().filter(|node| node.has_tag_name("text"));
    let letter =
        |node: &roxmltree::Node| node.text().is_some_and(|t| t.len() == 3 && &t[..1] == "(");
    let mut letters: Vec<(String, f64)> = texts
        .filter(letter)
        .map(|node| (node.text().unwrap().to_owned(), number(&node, "y")))
        .collect();
    letters.sort_by(|a, b| a.0.cmp(&b.0));
    let mut rects = document.descendants().filter(|node| node.has_tag_name("rect"));
    let frame = rects.rfind(|rect| rect.attribute("fill") == Some("none")).unwrap();
    let top = number(&frame, "y");
    let letters = letters.into_iter().map(|(_, y)| y).collect();
    (letters, [top, top + number(&frame, "height")])
}

#[test]
fn a_pair_is_observed_until_a_grain_leaves_the_box() {
    let folder = small_pair(0.0);
    std::fs::remove_dir_all(folder.join("slices")).unwrap();
    // Grain 1 leaves through the floor at 0.2 s, grain 0 at 0.3 s.
    let file = folder.join("grains.csv");
    let table = std::fs::read_to_string(&file).unwrap();
    let inside = |line: &&str| {
        let cells: Vec<&str> = line.split(',').collect();
        let end = if cells[1] == "1" { 0.2 } else { 0.3 };
        cells[0].parse::<f64>().map_or(true, |time| time <= end)
    };
    let kept: Vec<&str> = table.lines().filter(inside).collect();
    std::fs::write(&file, kept.join("\n") + "\n").unwrap();
    edit_rows(&folder, |cells| {
        let time: f64 = cells[0].parse().unwrap();
        cells[4] = (0.05 - 0.3 * time).to_string();
    });
    let left = |grain: usize, time: f64| {
        format!(
            "{{\"time\":{time},\"event\":\"left\",\"grains\":[{grain}],\"confirmed\":{time}}}\n"
        )
    };
    std::fs::write(folder.join("events.jsonl"), left(1, 0.2) + &left(0, 0.3)).unwrap();
    let summary = folder.join("summary.json");
    let text = std::fs::read_to_string(&summary).unwrap();
    let mut value: serde_json::Value = serde_json::from_str(&text).unwrap();
    value.as_object_mut().unwrap().remove("tumble_time_s");
    std::fs::write(&summary, value.to_string()).unwrap();
    let rendered = render(&folder).unwrap();
    let said = page(&rendered);
    assert!(said.contains("aria-label=\"Phases: drafting from 0 s to 0.200 s\""), "{said}");
    assert!(said.contains("when grain 1 leaves the box. (b)"), "{said}");
    assert!(said.contains("The letters are at the height of grain 0."), "{said}");
    let (letters, [top, bottom]) = letters_and_frame(&svg(&rendered, "trajectories"));
    assert!(letters.len() >= 2 && letters.is_sorted(), "{letters:?}");
    // The middle of a letter is 2.4 pt above its baseline.
    let inside = |y: &f64| (top..=bottom).contains(&(y - 2.4));
    assert!(letters.iter().all(inside), "{letters:?} {top} {bottom}");
    remove(&folder);
}

#[test]
fn letters_follow_a_grain_through_a_periodic_box() {
    let folder = fresh::folder("periodic");
    heap::heap(&folder, 3, false);
    let faces = "cells = [20, 20, 50]\n[domain.boundaries]\nx = \"wall\"\ny = \"wall\"\n\
                 z = \"periodic\"\n";
    replace(&folder, "case.resolved.toml", "cells = [20, 20, 50]\n", faces);
    // All grains fall by 60 mm in a box of 100 mm: only grain 0 stays clear of the periodic side.
    edit_rows(&folder, |cells| {
        let (time, grain): (f64, f64) = (cells[0].parse().unwrap(), cells[1].parse().unwrap());
        cells[4] = (0.09 - 0.1 * time - 0.03 * grain).to_string();
    });
    let in_order = || {
        let (letters, _) = letters_and_frame(&svg(&render(&folder).unwrap(), "trajectories"));
        assert!(letters.len() == 4 && letters.is_sorted(), "{letters:?}");
    };
    in_order();
    let words = |grain: usize| format!("The letters are at the height of grain {grain}.");
    assert!(page(&render(&folder).unwrap()).contains(&words(0)));
    // A grain that keeps its height has no letters.
    let rest = |grains: &[&str]| {
        edit_rows(&folder, |cells| {
            let time: f64 = cells[0].parse().unwrap();
            if grains.contains(&cells[1].as_str()) {
                cells[4] = (0.05 + 1e-9 * time).to_string();
            }
        });
    };
    rest(&["0"]);
    assert!(page(&render(&folder).unwrap()).contains(&words(1)));
    // All grains move sideways, at heights that change by round-off only.
    rest(&["1", "2"]);
    edit_rows(&folder, |cells| {
        let time: f64 = cells[0].parse().unwrap();
        cells[2] = (0.02 + 0.01 * time).to_string();
    });
    in_order();
    remove(&folder);
}

#[test]
fn paths_of_several_grains_have_two_outlines_each() {
    let folder = fresh::folder("several");
    heap::heap(&folder, 6, false);
    edit_rows(&folder, |cells| {
        let (time, grain): (f64, f64) = (cells[0].parse().unwrap(), cells[1].parse().unwrap());
        cells[4] = (0.09 - 0.05 * time - 0.005 * grain).to_string();
        cells[21] = "0".into();
    });
    let rendered = render(&folder).unwrap();
    let drawn = svg(&rendered, "trajectories");
    // Six grains at two instants, in two views.
    assert_eq!(drawn.matches("fill-opacity").count(), 6 * 2 * 2);
    assert!(letters_and_frame(&drawn).0.is_empty());
    assert!(!page(&rendered).contains("The letters are"));
    // Without contacts the axis of their number begins at 0.
    let history = text_of(&svg(&rendered, "history"));
    assert!(history.contains("contacts per grain") && !history.contains("−1.0"), "{history}");
    remove(&folder);
}

#[test]
fn a_table_of_one_row_gives_no_curves_and_the_peak_of_the_summary() {
    let folder = fresh::folder("one-row");
    flows::single(&folder);
    let table = std::fs::read_to_string(folder.join("grains.csv")).unwrap();
    let lines: Vec<&str> = table.lines().collect();
    // The last row is that of the rebound.
    let mut last: Vec<String> = lines[lines.len() - 1].split(',').map(str::to_owned).collect();
    last[7] = "0.183".into();
    std::fs::write(folder.join("grains.csv"), format!("{}\n{}\n", lines[0], last.join(",")))
        .unwrap();
    let summary = folder.join("summary.json");
    let mut value: serde_json::Value =
        serde_json::from_slice(&std::fs::read(&summary).unwrap()).unwrap();
    value["grains"] = serde_json::json!([{ "peak_settling_speed_m_per_s": 0.1216 }]);
    std::fs::write(&summary, value.to_string()).unwrap();
    let rendered = render(&folder).unwrap();
    let curves = ["trajectories", "velocity", "force", "orientation"];
    assert!(!names(&rendered).iter().any(|name| curves.contains(&name.as_str())));
    let said = page(&rendered);
    assert!(said.contains("largest settling speed was 0.122 m/s"), "{said}");
    assert!(!said.contains("upwards") && said.contains("fewer than two rows"));
    remove(&folder);
}

#[test]
fn round_off_of_resting_grains_is_not_drawn() {
    let folder = fresh::folder("rest");
    heap::heap(&folder, 5, false);
    edit_rows(&folder, |cells| {
        cells[4] = format!("0.0099997150{}", cells[1]);
        cells[5..8].fill("0".into());
    });
    let rendered = render(&folder).unwrap();
    let seen = text_of(&svg(&rendered, "positions"));
    assert!(!seen.contains("9.9997"), "{seen}");
    remove(&folder);

    let folder = fresh::folder("held");
    flows::single(&folder);
    edit_rows(&folder, |cells| {
        cells[2..5].fill("0.01".into());
        cells[15] = "0.444".into();
        cells[16] = "6.67e-18".into();
        cells[17] = "-8.13e-15".into();
    });
    let said = page(&render(&folder).unwrap());
    assert!(said.contains("(0.444, 0, 0) N at the end"), "{said}");
    remove(&folder);
}

#[test]
fn a_later_report_removes_the_figures_of_an_earlier_one_only() {
    let folder = fresh::folder("earlier");
    flows::single(&folder);
    let first = names(&render(&folder).unwrap());
    assert!(first.contains(&"velocity".to_owned()));
    let figures = folder.join("figures");
    std::fs::write(figures.join("mine.png"), "mine").unwrap();
    // A list cannot name a file elsewhere, or one that is no figure.
    let list = std::fs::read_to_string(figures.join(".figures")).unwrap();
    std::fs::write(figures.join(".figures"), list + "../case.resolved.toml\n../x.png\nnote.txt\n")
        .unwrap();
    std::fs::write(folder.join("x.png"), "").unwrap();
    std::fs::write(figures.join("note.txt"), "").unwrap();
    let table = std::fs::read_to_string(folder.join("grains.csv")).unwrap();
    let head: Vec<&str> = table.lines().take(2).collect();
    std::fs::write(folder.join("grains.csv"), head.join("\n") + "\n").unwrap();
    let second = names(&render(&folder).unwrap());
    assert!(!second.contains(&"velocity".to_owned()), "{second:?}");
    let kept = [folder.join("x.png"), folder.join("case.resolved.toml")];
    let own = ["mine.png", "note.txt", "speed.png", "speed.svg"].map(|name| figures.join(name));
    for file in kept.iter().chain(&own) {
        assert!(file.is_file(), "{}", file.display());
    }
    for name in ["velocity.png", "velocity.svg"] {
        assert!(!figures.join(name).exists(), "{name}");
    }
    remove(&folder);
}

#[test]
fn an_unfinished_pair_has_not_touched_so_far() {
    let folder = small_pair(0.9);
    write_log(&folder, &[]);
    assert!(page(&render(&folder).unwrap()).contains("The two grains did not touch."));
    std::fs::remove_file(folder.join("summary.json")).unwrap();
    assert!(page(&render(&folder).unwrap()).contains("have not touched so far"));
    remove(&folder);
}
