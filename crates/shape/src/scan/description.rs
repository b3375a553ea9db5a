//! Image descriptions of TIFF files: those of ImageJ (`ImageJ=1.53t`, one `key=value` per line) and
//! OME-XML.

use super::geometry::{Geometry, StatedVoxel};
use crate::error::{Result, ShapeError};
use std::path::Path;

/// Content of a description.
#[derive(Default)]
pub(super) struct Description {
    /// Number of images that an ImageJ stack states.
    pub images: Option<u64>,
    /// Names and numbers of slices, channels and frames.
    stack: Vec<(&'static str, u64)>,
    /// Number of image series.
    series: usize,
    /// Voxel edges along x, y and z.
    edges: [Option<f64>; 3],
    unit: String,
    /// Keys of the edges.
    keys: &'static str,
}

impl Description {
    /// Parses a description. `resolution` holds the pixels per unit along x and y.
    pub(super) fn parse(text: &str, resolution: [Option<f64>; 2]) -> Description {
        if text.starts_with("ImageJ=") {
            imagej(text, resolution)
        } else if text.contains("<OME") {
            ome(text)
        } else {
            Description::default()
        }
    }

    /// Refuses stacks of more than slices along z.
    pub(super) fn check_stack(&self, path: &Path) -> Result<()> {
        let refused = |reason: String| Err(ShapeError::unsupported(path, reason));
        if self.series > 1 {
            return refused(format!(
                "the file has {} image series; save one of them alone",
                self.series
            ));
        }
        // A single axis is the third one, whatever its name: some programs call slices channels.
        let axes: Vec<_> = self.stack.iter().filter(|(_, count)| *count > 1).collect();
        if axes.len() < 2 {
            return Ok(());
        }
        let axes = axes.iter().map(|(name, count)| format!("{count} {name}"));
        refused(format!(
            "the stack has {}; save the slices of one channel and time alone (ImageJ: Image > \
             Hyperstacks > Reduce Dimensionality)",
            axes.collect::<Vec<_>>().join(", ")
        ))
    }

    /// Returns the voxel edge if it is stated; refuses voxels that are not cubes.
    pub(super) fn voxel(&self, path: &Path) -> Result<Option<StatedVoxel>> {
        let [x, y, z] = self.edges;
        let Some(first) = x.or(y) else {
            return Ok(None);
        };
        let edges = [x, y, z].map(|edge| edge.unwrap_or(first));
        Geometry::of_edges(self.keys, edges, self.unit.clone()).voxel(path).map(Some)
    }
}

fn imagej(text: &str, resolution: [Option<f64>; 2]) -> Description {
    let value = |key: &str| {
        text.lines().find_map(|line| Some(line.trim().strip_prefix(key)?.strip_prefix('=')?.trim()))
    };
    let count = |key| value(key).and_then(|n| n.parse().ok());
    let spacing = value("spacing").and_then(|z| z.parse::<f64>().ok());
    let unit = value("unit").unwrap_or_default();
    // A resolution without a unit or spacing is that of a printer or screen. Edges in several units
    // are not compared.
    let one = value("yunit").is_none() && value("zunit").is_none();
    let calibrated = one && (spacing.is_some() || !unit.is_empty());
    let [x, y] = resolution.map(|pixels| pixels.filter(|p| *p > 0.0).map_or(1.0, f64::recip));
    Description {
        images: count("images"),
        stack: ["slices", "channels", "frames"]
            .into_iter()
            .filter_map(|key| Some((key, count(key)?)))
            .collect(),
        series: 1,
        edges: if calibrated { [Some(x), Some(y), spacing.map(f64::abs)] } else { [None; 3] },
        unit: unit.to_owned(),
        keys: "XResolution, YResolution and the spacing of ImageJ",
    }
}

fn ome(text: &str) -> Description {
    let mut series = text.split("<Pixels").skip(1);
    let Some(pixels) = series.next().and_then(|rest| rest.split('>').next()) else {
        return Description::default();
    };
    let value = |key: &str| {
        let quoted = pixels.split_once(&format!(" {key}="))?.1;
        let quote = quoted.chars().next().filter(|c| matches!(c, '"' | '\''))?;
        quoted[1..].split(quote).next()
    };
    let count = |key| value(key).and_then(|n| n.parse().ok());
    let edge = |key| value(key).and_then(|n| n.parse().ok());
    let unit = |key| value(key).unwrap_or("µm");
    // Edges in several units are not compared.
    let one = unit("PhysicalSizeXUnit") == unit("PhysicalSizeYUnit")
        && unit("PhysicalSizeXUnit") == unit("PhysicalSizeZUnit");
    let keys = ["PhysicalSizeX", "PhysicalSizeY", "PhysicalSizeZ"];
    Description {
        images: None,
        stack: [("slices", "SizeZ"), ("channels", "SizeC"), ("times", "SizeT")]
            .into_iter()
            .filter_map(|(name, key)| Some((name, count(key)?)))
            .collect(),
        series: 1 + series.count(),
        edges: if one { keys.map(edge) } else { [None; 3] },
        unit: unit("PhysicalSizeXUnit").to_owned(),
        keys: "PhysicalSizeX, PhysicalSizeY and PhysicalSizeZ of OME",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stated(text: &str, resolution: [Option<f64>; 2]) -> std::result::Result<String, String> {
        let (path, read) = (Path::new("a.tif"), Description::parse(text, resolution));
        read.check_stack(path).map_err(|e| e.to_string())?;
        let voxel = read.voxel(path).map_err(|e| e.to_string())?;
        Ok(voxel.map_or(String::new(), |voxel| voxel.to_string()))
    }

    #[test]
    fn the_calibration_of_imagej() {
        let head = "ImageJ=1.53t\nimages=24\nslices=24\n";
        let voxel =
            |more: &str, x: f64, y: f64| stated(&format!("{head}{more}\n"), [Some(x), Some(y)]);
        assert_eq!(voxel("unit=micron\nspacing=25.0", 0.04, 0.04), Ok("25 micron".into()));
        assert_eq!(voxel("unit=mm\nspacing=0.01", 100.0, 100.0), Ok("0.01 mm".into()));
        let squashed = voxel("unit=micron\nspacing=25.0", 0.1, 0.1).unwrap_err();
        assert!(squashed.contains("10 x 10 x 25 micron"), "{squashed}");
        assert!(voxel("unit=micron", 0.1, 0.2).unwrap_err().contains("10 x 5 x 10"));
        // Without tags of resolution a pixel has the edge 1.
        let bare = stated(&format!("{head}unit=micron\nspacing=25.0\n"), [None; 2]);
        assert!(bare.unwrap_err().contains("1 x 1 x 25 micron"));
        // The resolution of a screen is no calibration, nor is that of other programs.
        assert_eq!(voxel("", 72.0, 100.0), Ok(String::new()));
        assert_eq!(stated("scan 3\nspacing=4\nunit=mm\n", [Some(1.0); 2]), Ok(String::new()));
    }

    #[test]
    fn the_calibration_of_ome() {
        let file = |pixels: &str| {
            let text = format!("<?xml version=\"1.0\"?><OME><Image><Pixels {pixels}></Pixels>");
            stated(&text, [Some(72.0); 2])
        };
        let sizes = "SizeX=\"9\" SizeY=\"8\" SizeZ=\"40\" SizeC=\"1\" SizeT=\"1\"";
        let physical = |x: &str, z: &str| {
            file(&format!("{sizes} PhysicalSizeX='{x}' PhysicalSizeY='{x}' PhysicalSizeZ='{z}'"))
        };
        assert_eq!(physical("0.65", "0.65"), Ok("0.65 µm".into()));
        assert!(physical("0.65", "2").unwrap_err().contains("0.65 x 0.65 x 2 µm"));
        let millimetres = file(
            "PhysicalSizeX=\"0.1\" PhysicalSizeXUnit=\"mm\" \
                                PhysicalSizeYUnit=\"mm\" PhysicalSizeZUnit=\"mm\"",
        );
        assert_eq!(millimetres, Ok("0.1 mm".into()));
        assert_eq!(file(sizes), Ok(String::new()));
        let channels = file(&sizes.replace("SizeC=\"1\"", "SizeC=\"2\"")).unwrap_err();
        assert!(channels.contains("40 slices, 2 channels"), "{channels}");
        let series = stated("<OME><Pixels a=\"\"/><Pixels b=\"\"/></OME>", [None; 2]);
        assert!(series.unwrap_err().contains("2 image series"));
    }

    #[test]
    fn stacks_of_several_channels_or_times() {
        let stack = |more: &str| stated(&format!("ImageJ=1.53t\nimages=80\n{more}\n"), [None; 2]);
        let two = stack("channels=2\nslices=40\nhyperstack=true").unwrap_err();
        assert!(two.contains("40 slices, 2 channels") && two.contains("Reduce"), "{two}");
        let times = stack("slices=40\nframes=2").unwrap_err();
        assert!(times.contains("40 slices, 2 frames"), "{times}");
        for one in ["slices=80", "channels=80", "frames=80\nslices=1\nchannels=1", ""] {
            assert_eq!(stack(one), Ok(String::new()), "{one}");
        }
    }
}
