//! The control block in words: the counterpart of `Control::read`.

use std::collections::BTreeMap;

use crate::control::Control;
use crate::detect::CONTROL_WORDS;

/// Words behind the 64 where one of them is needed; what the solver writes.
pub(super) const EXTRA: u64 = 64;

/// Whether a word behind the first 64 says something. VTK's reader dies of any word there, so none is written in vain.
pub(super) fn needs_extra(control: &Control) -> bool {
    let of_elements = control.nt3d > 0 && control.solids > 0 || control.neipb > 0 && control.beams > 0;
    of_elements || control.penetration > 0 || control.contact_energy || control.kinetic_energy
}

/// Adds the control block. Words that are not named here are 0.
pub(super) fn encode(control: &Control, into: &mut Vec<u8>) {
    let words = control.words;
    into.extend(text(&control.title, 10 * words.size() as usize));
    let values = values(control);
    for word in 10..CONTROL_WORDS + control.extra {
        match word {
            13 => into.extend(text(control.release.as_bytes(), words.size() as usize)),
            // what every file of LS-DYNA has
            14 => words.push_floats(into, [960.0]),
            _ => words.push_int(into, values.get(&word).copied().unwrap_or(0)),
        }
    }
}

fn values(control: &Control) -> BTreeMap<u64, i64> {
    let inum = control.file_type.number() + if control.wide_numbers { 1000 } else { 0 };
    let solids = control.solids as i64;
    let layers = control.layers as i64;
    let [solid_parts, beam_parts, shell_parts, sph_parts, thick_shell_parts] =
        control.parts_of_kind.map(|of| of as i64);
    let written = |shells: bool, solids: bool| match (shells, solids) {
        (true, _) => 1000,
        (false, true) => 999,
        (false, false) => 0,
    };
    BTreeMap::from([
        (10, control.run_time),
        (11, inum),
        (15, control.ndim),
        (16, control.nodes as i64),
        (17, 6),
        (18, control.globals as i64),
        (19, control.temperature + if control.mass_scaling { 10 } else { 0 }),
        (20, control.iu),
        (21, i64::from(control.velocity)),
        (22, i64::from(control.acceleration)),
        (23, solids),
        (24, solid_parts),
        (25, if control.in_plane_points { -1 } else { 0 }),
        (27, control.nv3d as i64),
        (28, control.beams as i64),
        (29, beam_parts),
        (30, control.nv1d as i64),
        (31, control.shells as i64),
        (32, shell_parts),
        (33, control.nv2d as i64),
        (34, control.neiph as i64),
        (35, control.neips as i64),
        (36, [layers, -layers.max(1), -layers - 10_000][control.mdlopt.min(2) as usize]),
        (37, control.sph as i64),
        (38, sph_parts),
        (39, control.narbs as i64),
        (40, control.thick_shells as i64),
        (41, thick_shell_parts),
        (42, control.nv3dt as i64),
        (43, written(control.shell_stress, control.solid_stress)),
        (44, written(control.shell_strain, control.solid_strain)),
        (45, written(control.shell_resultants, false)),
        (46, written(control.shell_thickness, false)),
        (51, control.parts as i64),
        (53, 1),
        (56, control.idtdt),
        (57, control.extra as i64),
        (65, control.nt3d as i64),
        (67, control.neipb as i64),
        (78, control.penetration as i64 / 3),
        (79, i64::from(control.contact_energy)),
        (81, i64::from(control.kinetic_energy)),
    ])
}

/// Text of a fixed length: cut, or filled with blanks.
pub(super) fn text(text: &[u8], bytes: usize) -> Vec<u8> {
    let mut text = text[..text.len().min(bytes)].to_vec();
    text.resize(bytes, b' ');
    text
}
