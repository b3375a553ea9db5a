//! Tiled TIFF and BigTIFF, byte by byte: encoders at hand write neither.

/// Columns, rows and pages; the tiles of 16 x 16 stand out over the right and lower edge.
pub const SIZE: [usize; 3] = [40, 24, 3];
const TILE: usize = 16;

pub fn value(x: usize, y: usize, z: usize) -> u16 {
    (1000 * z + 40 * y + x) as u16
}

/// Whole numbers as this kind of TIFF writes them: `wide` for BigTIFF.
pub struct Layout {
    pub wide: bool,
}

impl Layout {
    fn word(&self, file: &mut Vec<u8>, value: usize) {
        match self.wide {
            true => file.extend((value as u64).to_le_bytes()),
            false => file.extend((value as u32).to_le_bytes()),
        }
    }
    fn entry(&self, file: &mut Vec<u8>, tag: u16, kind: u16, count: usize, value: usize) {
        file.extend(tag.to_le_bytes());
        file.extend(kind.to_le_bytes());
        self.word(file, count);
        self.word(file, value);
    }

    pub fn file(&self) -> Vec<u8> {
        let [columns, rows, pages] = SIZE;
        let across = columns.div_ceil(TILE);
        let tiles = across * rows.div_ceil(TILE);
        let mut file = match self.wide {
            true => b"II\x2b\0\x08\0\0\0".to_vec(),
            false => b"II\x2a\0".to_vec(),
        };
        let mut link = file.len();
        self.word(&mut file, 0);
        for z in 0..pages {
            let mut places = Vec::new();
            for tile in 0..tiles {
                places.push(file.len());
                let (left, top) = (tile % across * TILE, tile / across * TILE);
                for y in top..top + TILE {
                    for x in left..left + TILE {
                        let inside = x < columns && y < rows;
                        let sample = if inside { value(x, y, z) } else { 60_000 };
                        file.extend(sample.to_le_bytes());
                    }
                }
            }
            let offsets = file.len();
            places.iter().for_each(|p| self.word(&mut file, *p));
            let lengths = file.len();
            (0..tiles).for_each(|_| self.word(&mut file, 2 * TILE * TILE));
            let here = file.len();
            let size = if self.wide { 8 } else { 4 };
            let mut head = Vec::new();
            self.word(&mut head, here);
            file[link..link + size].copy_from_slice(&head);
            match self.wide {
                true => file.extend(10u64.to_le_bytes()),
                false => file.extend(10u16.to_le_bytes()),
            }
            let long = if self.wide { 16 } else { 4 };
            for (tag, kind, count, value) in [
                (256, 4, 1, columns),
                (257, 4, 1, rows),
                (258, 3, 1, 16),
                (259, 3, 1, 1),
                (262, 3, 1, 1),
                (277, 3, 1, 1),
                (322, 4, 1, TILE),
                (323, 4, 1, TILE),
                (324, long, tiles, offsets),
                (325, long, tiles, lengths),
            ] {
                self.entry(&mut file, tag, kind, count, value);
            }
            link = file.len();
            self.word(&mut file, 0);
        }
        file
    }
}
