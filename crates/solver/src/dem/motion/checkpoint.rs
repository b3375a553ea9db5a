//! Exact contact history in a checkpoint.
//!
//! Layout, little-endian: signature and version; number of grains and their positions at the end of
//! the last step; number of pairs in contact and each pair; number of contacts and each contact.
//! Older versions are read as well. Version 1 has no tangential stiffness in its pairs. Versions 1
//! and 2 have other contact points than today; a pair keeps its mean displacement.

use std::io::{self, Read, Write};

use grainwake_formats::codec::{Decoder, Encoder, invalid};

use super::ContactDynamics;
use crate::dem::contact::{Contact, ContactRecord, TangentialHistory};
use crate::dem::enclosure::{PairKey, Partner};
use crate::math::Load;

const SIGNATURE: [u8; 7] = *b"GWDEM\0\0";
const VERSION: u8 = 3;
const WALL: u64 = 1 << 63;
/// Largest number of grains, pairs, contacts or contact points.
const LIMIT: u64 = u32::MAX as u64;

fn damaged(what: &str) -> io::Error {
    invalid(format!("contact history is damaged: {what}"))
}

fn encode_partner(out: &mut Encoder, partner: Partner) -> io::Result<()> {
    match partner {
        Partner::Grain(index) => out.u64(index as u64),
        Partner::Wall { axis, side } => out.u64(WALL | u64::from(axis) << 1 | u64::from(side)),
    }
}

fn decode_partner(input: &mut Decoder, grains: usize) -> io::Result<Partner> {
    let code = input.u64()?;
    if code < grains as u64 {
        return Ok(Partner::Grain(code as usize));
    }
    let wall = code ^ WALL;
    if wall < 6 {
        return Ok(Partner::Wall { axis: (wall >> 1) as u8, side: (wall & 1) as u8 });
    }
    Err(damaged("a pair names no grain and no wall"))
}

/// Decodes the index of one of `grains`.
fn decode_grain(input: &mut Decoder, grains: usize) -> io::Result<usize> {
    let index = input.u64()?;
    if index < grains as u64 { Ok(index as usize) } else { Err(damaged("a pair names no grain")) }
}

impl ContactDynamics {
    /// Writes the exact contact history and contacts.
    ///
    /// # Errors
    /// The writer fails.
    pub fn save(&self, writer: &mut dyn Write) -> io::Result<()> {
        let mut out = Encoder::new(writer);
        out.raw(&SIGNATURE)?;
        out.u8(VERSION)?;
        out.u64(self.last_positions.len() as u64)?;
        for position in &self.last_positions {
            out.vector(*position)?;
        }
        let in_contact = || self.records.iter().filter(|record| record.in_contact);
        out.u64(in_contact().count() as u64)?;
        for record in in_contact() {
            encode_record(&mut out, record)?;
        }
        out.u64(self.contacts.len() as u64)?;
        for contact in &self.contacts {
            out.u64(contact.grain as u64)?;
            encode_partner(&mut out, contact.partner)?;
            out.f64(contact.overlap)?;
            let load = &contact.load;
            for vector in [load.force, load.torque, contact.point, contact.normal] {
                out.vector(vector)?;
            }
        }
        Ok(())
    }

    /// Restores the state that [`save`](Self::save) wrote; parameters and box do not change.
    ///
    /// # Errors
    /// The bytes are no contact history of a known version, or are damaged. The state is unchanged.
    pub fn restore(&mut self, reader: &mut dyn Read) -> io::Result<()> {
        let mut signature = [0; SIGNATURE.len()];
        reader.read_exact(&mut signature)?;
        if signature != SIGNATURE {
            return Err(damaged("its first bytes are not those of a contact history"));
        }
        let mut input = Decoder::new(reader);
        let version = input.u8()?;
        if !(1..=VERSION).contains(&version) {
            return Err(damaged(&format!(
                "version {version} is unknown; this program reads versions 1 to {VERSION}"
            )));
        }
        let grains = input.count(LIMIT, "grains")?;
        let last_positions = input.list(grains, |input| input.vector())?;
        let pairs = input.count(LIMIT, "pairs")?;
        let records = input.list(pairs, |input| decode_record(input, grains, version))?;
        if !records.is_sorted_by(|a, b| a.key < b.key) {
            return Err(damaged("its pairs are out of order"));
        }
        let contacts = input.count(LIMIT, "contacts")?;
        let contacts = input.list(contacts, |input| {
            Ok(Contact {
                grain: decode_grain(input, grains)?,
                partner: decode_partner(input, grains)?,
                overlap: input.f64()?,
                load: Load { force: input.vector()?, torque: input.vector()? },
                point: input.vector()?,
                normal: input.vector()?,
            })
        })?;
        (self.last_positions, self.records, self.contacts) = (last_positions, records, contacts);
        Ok(())
    }
}

fn encode_record(out: &mut Encoder, record: &ContactRecord) -> io::Result<()> {
    out.u64(u64::from(record.key.grain))?;
    encode_partner(out, record.key.partner)?;
    for periods in record.key.image {
        out.u64(periods as i64 as u64)?;
    }
    out.vector(record.mean_history.normal)?;
    out.vector(record.mean_history.displacement)?;
    out.f64(record.dashpot_fraction)?;
    out.f64(record.tangential_stiffness)?;
    out.f64(record.loads.elastic_energy)?;
    out.u64(record.history.len() as u64)?;
    for entry in &record.history {
        out.u64(u64::from(entry.id))?;
        out.vector(entry.normal)?;
        out.vector(entry.displacement)?;
    }
    Ok(())
}

fn decode_record(input: &mut Decoder, grains: usize, version: u8) -> io::Result<ContactRecord> {
    let grain = decode_grain(input, grains)? as u32;
    let partner = decode_partner(input, grains)?;
    let mut image = [0; 3];
    for periods in &mut image {
        *periods = i32::try_from(input.u64()? as i64).map_err(|_| damaged("image of a pair"))?;
    }
    let mut record = ContactRecord::new(PairKey { grain, partner, image });
    record.in_contact = true;
    record.mean_history.normal = input.vector()?;
    record.mean_history.displacement = input.vector()?;
    record.dashpot_fraction = input.f64()?;
    if version > 1 {
        record.tangential_stiffness = input.f64()?;
    }
    record.loads.elastic_energy = input.f64()?;
    let points = input.count(LIMIT, "contact points")?;
    record.history = input.list(points, |input| {
        let id = input.u64()?;
        Ok(TangentialHistory {
            id: u32::try_from(id).map_err(|_| damaged("identifier of a contact point"))?,
            normal: input.vector()?,
            displacement: input.vector()?,
        })
    })?;
    if !record.history.is_sorted_by(|a, b| a.id < b.id) {
        return Err(damaged("its contact points are out of order"));
    }
    if version < 3 {
        record.history.clear();
    }
    Ok(record)
}
