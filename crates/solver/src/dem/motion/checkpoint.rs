//! Contact history as bytes, bit for bit.
//!
//! Layout, little-endian: magic with version; number of grains and their positions at the end of
//! the last step; number of pairs in contact and each pair; number of contacts and each contact.
//! Version 1 has no tangential stiffness in its pairs; it is read as well.

use std::io::{self, Read, Write};

use glam::{DVec3, IVec3};

use super::dynamics::Dynamics;
use crate::dem::contact::{Contact, ContactRecord, TangentialHistory};
use crate::dem::search::{PairKey, Partner};
use crate::math::Load;

const MAGIC: [u8; 7] = *b"GWDEM\0\0";
const VERSION: u8 = 2;
const WALL: u64 = 1 << 63;
/// Largest number of entries that is reserved before they are read, so that a damaged count does
/// not exhaust the memory.
const RESERVE: u64 = 4096;

fn damaged(what: &str) -> io::Error {
    io::Error::new(
        io::ErrorKind::InvalidData,
        format!("contact history is damaged: {what}"),
    )
}

fn put(w: &mut dyn Write, value: u64) -> io::Result<()> {
    w.write_all(&value.to_le_bytes())
}
fn put_real(w: &mut dyn Write, value: f64) -> io::Result<()> {
    w.write_all(&value.to_le_bytes())
}
fn put_vector(w: &mut dyn Write, v: DVec3) -> io::Result<()> {
    v.to_array().into_iter().try_for_each(|x| put_real(w, x))
}
fn put_partner(w: &mut dyn Write, partner: Partner) -> io::Result<()> {
    match partner {
        Partner::Grain(index) => put(w, index as u64),
        Partner::Wall { axis, side } => put(w, WALL | u64::from(axis) << 1 | u64::from(side)),
    }
}

fn get(r: &mut dyn Read) -> io::Result<u64> {
    let mut bytes = [0; 8];
    r.read_exact(&mut bytes)?;
    Ok(u64::from_le_bytes(bytes))
}
fn get_real(r: &mut dyn Read) -> io::Result<f64> {
    Ok(f64::from_bits(get(r)?))
}
fn get_vector(r: &mut dyn Read) -> io::Result<DVec3> {
    Ok(DVec3::new(get_real(r)?, get_real(r)?, get_real(r)?))
}
fn get_partner(r: &mut dyn Read, grains: u64) -> io::Result<Partner> {
    let code = get(r)?;
    if code < grains {
        return Ok(Partner::Grain(code as usize));
    }
    let wall = code ^ WALL;
    if wall < 6 {
        return Ok(Partner::Wall {
            axis: (wall >> 1) as u8,
            side: (wall & 1) as u8,
        });
    }
    Err(damaged("a pair names no grain and no wall"))
}
fn get_count(r: &mut dyn Read, most: u64, what: &str) -> io::Result<u64> {
    let count = get(r)?;
    if count <= most {
        Ok(count)
    } else {
        Err(damaged(what))
    }
}
fn list<T>(count: u64) -> Vec<T> {
    Vec::with_capacity(count.min(RESERVE) as usize)
}

impl Dynamics {
    /// Writes the contact history and the contacts, bit for bit.
    pub fn save(&self, writer: &mut dyn Write) -> io::Result<()> {
        let w = writer;
        w.write_all(&MAGIC)?;
        w.write_all(&[VERSION])?;
        put(w, self.last_positions.len() as u64)?;
        self.last_positions
            .iter()
            .try_for_each(|&x| put_vector(w, x))?;
        let in_contact = || self.records.iter().filter(|record| record.in_contact);
        put(w, in_contact().count() as u64)?;
        for record in in_contact() {
            put(w, u64::from(record.key.grain))?;
            put_partner(w, record.key.partner)?;
            for periods in record.key.image.to_array() {
                put(w, periods as i64 as u64)?;
            }
            put_vector(w, record.mean_history.normal)?;
            put_vector(w, record.mean_history.displacement)?;
            put_real(w, record.dashpot_fraction)?;
            put_real(w, record.tangential_stiffness)?;
            put_real(w, record.loads.elastic_energy)?;
            put(w, record.history.len() as u64)?;
            for entry in &record.history {
                put(w, u64::from(entry.id))?;
                put_vector(w, entry.normal)?;
                put_vector(w, entry.displacement)?;
            }
        }
        put(w, self.contacts.len() as u64)?;
        for contact in &self.contacts {
            put(w, contact.grain as u64)?;
            put_partner(w, contact.partner)?;
            put_real(w, contact.overlap)?;
            for v in [
                contact.load.force,
                contact.load.torque,
                contact.point,
                contact.normal,
            ] {
                put_vector(w, v)?;
            }
        }
        Ok(())
    }

    /// Restores the state that [`save`](Self::save) wrote; parameters and box do not change.
    ///
    /// # Errors
    /// The bytes are no contact history of a known version, or are damaged. The state is unchanged.
    pub fn restore(&mut self, reader: &mut dyn Read) -> io::Result<()> {
        let r = reader;
        let mut start = [0; 8];
        r.read_exact(&mut start)?;
        let version = start[7];
        if start[..7] != MAGIC {
            return Err(damaged(
                "its first bytes are not those of a contact history",
            ));
        }
        if !(1..=VERSION).contains(&version) {
            return Err(damaged(&format!(
                "version {version} is unknown; this program reads versions 1 to {VERSION}"
            )));
        }
        let grains = get_count(r, u64::from(u32::MAX), "number of grains")?;
        let mut last_positions = list(grains);
        for _ in 0..grains {
            last_positions.push(get_vector(r)?);
        }
        let pairs = get_count(r, u64::from(u32::MAX), "number of pairs")?;
        let mut records: Vec<ContactRecord> = list(pairs);
        for _ in 0..pairs {
            let record = read_record(r, grains, version)?;
            if (records.last()).is_some_and(|before| before.key >= record.key) {
                return Err(damaged("its pairs are out of order"));
            }
            records.push(record);
        }
        let count = get_count(r, u64::from(u32::MAX), "number of contacts")?;
        let mut contacts = list(count);
        for _ in 0..count {
            let grain = get_count(r, grains.saturating_sub(1), "grain of a contact")? as usize;
            let partner = get_partner(r, grains)?;
            let overlap = get_real(r)?;
            let load = Load {
                force: get_vector(r)?,
                torque: get_vector(r)?,
            };
            let (point, normal) = (get_vector(r)?, get_vector(r)?);
            contacts.push(Contact {
                grain,
                partner,
                overlap,
                load,
                point,
                normal,
            });
        }
        (self.last_positions, self.records, self.contacts) = (last_positions, records, contacts);
        Ok(())
    }
}

fn read_record(r: &mut dyn Read, grains: u64, version: u8) -> io::Result<ContactRecord> {
    let grain = get(r)?;
    if grain >= grains {
        return Err(damaged("a pair names no grain"));
    }
    let partner = get_partner(r, grains)?;
    let mut image = IVec3::ZERO;
    for axis in 0..3 {
        image[axis] = i32::try_from(get(r)? as i64).map_err(|_| damaged("image of a pair"))?;
    }
    let mut record = ContactRecord::new(PairKey {
        grain: grain as u32,
        partner,
        image,
    });
    record.in_contact = true;
    record.mean_history.normal = get_vector(r)?;
    record.mean_history.displacement = get_vector(r)?;
    record.dashpot_fraction = get_real(r)?;
    if version > 1 {
        record.tangential_stiffness = get_real(r)?;
    }
    record.loads.elastic_energy = get_real(r)?;
    let nodes = get_count(r, u64::from(u32::MAX), "number of contact points")?;
    record.history = list(nodes);
    for _ in 0..nodes {
        let id = u32::try_from(get(r)?).map_err(|_| damaged("identifier of a contact point"))?;
        if record.history.last().is_some_and(|before| before.id >= id) {
            return Err(damaged("its contact points are out of order"));
        }
        record.history.push(TangentialHistory {
            id,
            normal: get_vector(r)?,
            displacement: get_vector(r)?,
        });
    }
    Ok(record)
}
