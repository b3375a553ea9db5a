//! The memory of contact as bytes, bit for bit.
//!
//! Layout, little-endian: magic, version, count of grains and their positions at the end of the last
//! step; count of remembered pairs and each pair; count of contacts and each contact.

use std::io::{self, Read, Write};

use glam::{DVec3, IVec3};

use super::dynamics::Dynamics;
use super::history::{Memory, PairKey, Slot};
use super::{Contact, Partner};
use crate::math::Load;

const MAGIC: [u8; 8] = *b"GWDEM\0\0\x01";
const WALL: u64 = 1 << 63;
/// Damaged counts must not ask for memory: at most so much is reserved before the bytes are seen.
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
        put(w, self.last.len() as u64)?;
        self.last.iter().try_for_each(|&x| put_vector(w, x))?;
        let touching = || self.slots.iter().filter(|slot| slot.touching);
        put(w, touching().count() as u64)?;
        for slot in touching() {
            put(w, u64::from(slot.key.grain))?;
            put_partner(w, slot.key.partner)?;
            for periods in slot.key.image.to_array() {
                put(w, periods as i64 as u64)?;
            }
            put_vector(w, slot.mean.normal)?;
            put_vector(w, slot.mean.slip)?;
            put_real(w, slot.onset)?;
            put_real(w, slot.outcome.elastic_energy)?;
            put(w, slot.memory.len() as u64)?;
            for memory in &slot.memory {
                put(w, u64::from(memory.code))?;
                put_vector(w, memory.normal)?;
                put_vector(w, memory.slip)?;
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

    /// Restores what [`save`](Self::save) wrote; parameters and box stay as they are. On an error
    /// nothing changes.
    pub fn restore(&mut self, reader: &mut dyn Read) -> io::Result<()> {
        let r = reader;
        let mut magic = [0; 8];
        r.read_exact(&mut magic)?;
        if magic != MAGIC {
            return Err(damaged(
                "it does not begin as one, or is of another version",
            ));
        }
        let grains = get_count(r, u64::from(u32::MAX), "count of grains")?;
        let mut last = list(grains);
        for _ in 0..grains {
            last.push(get_vector(r)?);
        }
        let pairs = get_count(r, u64::from(u32::MAX), "count of pairs")?;
        let mut slots: Vec<Slot> = list(pairs);
        for _ in 0..pairs {
            let slot = read_slot(r, grains)?;
            if slots.last().is_some_and(|before| before.key >= slot.key) {
                return Err(damaged("its pairs are out of order"));
            }
            slots.push(slot);
        }
        let count = get_count(r, u64::from(u32::MAX), "count of contacts")?;
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
        (self.last, self.slots, self.contacts) = (last, slots, contacts);
        Ok(())
    }
}

fn read_slot(r: &mut dyn Read, grains: u64) -> io::Result<Slot> {
    let grain = get(r)?;
    if grain >= grains {
        return Err(damaged("a pair names no grain"));
    }
    let partner = get_partner(r, grains)?;
    let mut image = IVec3::ZERO;
    for axis in 0..3 {
        image[axis] = i32::try_from(get(r)? as i64).map_err(|_| damaged("image of a pair"))?;
    }
    let mut slot = Slot::new(PairKey {
        grain: grain as u32,
        partner,
        image,
    });
    slot.touching = true;
    slot.mean.normal = get_vector(r)?;
    slot.mean.slip = get_vector(r)?;
    slot.onset = get_real(r)?;
    slot.outcome.elastic_energy = get_real(r)?;
    let nodes = get_count(r, u64::from(u32::MAX), "count of nodes")?;
    slot.memory = list(nodes);
    for _ in 0..nodes {
        let code = u32::try_from(get(r)?).map_err(|_| damaged("code of a node"))?;
        if slot.memory.last().is_some_and(|before| before.code >= code) {
            return Err(damaged("its nodes are out of order"));
        }
        slot.memory.push(Memory {
            code,
            normal: get_vector(r)?,
            slip: get_vector(r)?,
        });
    }
    Ok(slot)
}
