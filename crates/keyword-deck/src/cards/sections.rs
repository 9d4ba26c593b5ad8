//! *SECTION_…: id, formulation, thickness; *MAT_…: id and name.

use super::Block;
use crate::deck::{Deck, Material, Section};
use crate::error::Error;
use crate::row::TENS;

pub(crate) fn section(block: &Block<'_>, deck: &mut Deck) -> Result<(), Error> {
    let frame = block.frame;
    let kind = block.words.get(1).copied().unwrap_or_default();
    let title_cards = usize::from(block.has("TITLE"));
    // Options other than TITLE have cards of their own; then one section a block is read.
    let plain = block.words[1..].iter().all(|word| *word == kind || *word == "TITLE");
    let mut at = 0;
    while !block.ends_at(at + title_cards) {
        let title = match title_cards {
            0 => String::new(),
            _ => frame.title(block.card(at, "a section's title")?.title()),
        };
        at += title_cards;
        let row = block.row(at, TENS, "a section's card (SECID, ELFORM, …)")?;
        let id = row.moved(0, "SECID", frame.other)?;
        if id == 0 {
            return Err(row.wrong(0, "SECID", "a section's id, from 1"));
        }
        let known = matches!(kind, "SHELL" | "SOLID" | "BEAM" | "TSHELL");
        let formulation = if known { row.integer(1, "ELFORM").unwrap_or(0) } else { 0 };
        at += 1;
        let mut thickness = None;
        let mut angles = 0;
        if matches!(kind, "SHELL" | "TSHELL") && row.real(6, "ICOMP")? == 1.0 {
            let points = row.real(3, "NIP")?.clamp(0.0, 1e4) as usize;
            angles = if points == 0 { 2 } else { points }.div_ceil(8);
        }
        match kind {
            "SHELL" => {
                let row = block.row(at, TENS, "the thicknesses (T1, …)")?;
                let mut values = [0.0; 4];
                for (corner, value) in values.iter_mut().enumerate() {
                    *value = row.real(corner, "T")? * frame.length;
                }
                // Blank corners have the first one's thickness.
                if values[1..] == [0.0; 3] {
                    values = [values[0]; 4];
                }
                thickness = Some(values);
                at += 1 + angles;
            }
            "TSHELL" => at += angles,
            "BEAM" => {
                if let Ok(row) = block.row(at, TENS, "")
                    && matches!(formulation, 1 | 9 | 11)
                    && let (Ok(first), Ok(second)) = (row.real(0, "TS1"), row.real(1, "TS2"))
                {
                    thickness = Some([first * frame.length, second * frame.length, 0.0, 0.0]);
                }
                at += 1;
            }
            _ => {}
        }
        deck.sections.push(Section { id, title, kind: kind.to_owned(), formulation, thickness });
        // User-defined formulations, and sections of other kinds, have cards that are not counted here.
        if !plain || !known || (101..=105).contains(&formulation) {
            break;
        }
    }
    Ok(())
}

pub(crate) fn material(block: &Block<'_>, deck: &mut Deck) -> Result<(), Error> {
    // *MAT_ADD_… add to a material that is defined elsewhere.
    if block.words.get(1) == Some(&"ADD") || block.cards.is_empty() {
        return Ok(());
    }
    let titled = block.words.last() == Some(&"TITLE");
    let title = match (titled, block.cards.first()) {
        (true, Some(card)) => block.frame.title(card.title()),
        _ => String::new(),
    };
    let row = block.row(usize::from(titled), TENS, "a material's card (MID, …)")?;
    // A few materials have a name for an id; none that joins parts does.
    let Ok(id) = row.moved(0, "MID", block.frame.material) else { return Ok(()) };
    let keyword = if titled { block.keyword.trim_end_matches("_TITLE") } else { block.keyword };
    deck.materials.push(Material { id, keyword: keyword.to_owned(), title });
    Ok(())
}
