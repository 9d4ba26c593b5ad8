//! The layout of one state: which blocks it holds, in the order in which they stand.
//!
//! Lengths come from the words a thing has (NV1D, NV2D, NV3D, NV3DT), never from adding up what these should contain.
//! Where the manual is ambiguous there are several layouts; the walk over the members tells which fits the end marks.

use crate::control::Control;
use crate::geometry::Reading;

/// A field of every state: one row a thing, so many words a row. The tables, in the order of the file:
///
/// - of the state: `time`, `globals`;
/// - of nodes: `coordinates` or `displacement`, `temperature`, `heat_flux`, `mass_scaling`, `temperature_rate`,
///   `residual_force`, `residual_moment`, `contact_penetration`, `contact_energy`, `kinetic_energy`, `velocity`,
///   `acceleration`;
/// - of elements: `solid_thermal`, `solid`, `thick_shell`, `beam`, `shell` (stress, plastic strain, histories …);
/// - the rest: `node_deletion` or `element_deletion` (0 = deleted; elements in the order solids, thick shells, shells,
///   beams), `sph`, `airbag`, `airbag_particle`, `road`, `rigid_motion`.
///
/// Quantities are taken out of the tables of elements; their columns are points × components:
///
/// - `shell_stress`, `shell_plastic_strain`, `shell_history`, `shell_bending_moment`, `shell_shear_force`,
///   `shell_normal_force`, `shell_thickness`, `shell_element_variable`, `shell_strain` (6 inner, 6 outer),
///   `shell_internal_energy`, `shell_plastic_strain_tensor`, `shell_thermal_strain`;
/// - `thick_shell_stress`, `thick_shell_plastic_strain`, `thick_shell_history`, `thick_shell_strain`,
///   `thick_shell_internal_energy`;
/// - `solid_stress`, `solid_plastic_strain`, `solid_history`, `solid_strain`;
/// - `beam_axial_force`, `beam_shear_force`, `beam_bending_moment`, `beam_torsion_moment`, and for each integration point
///   `beam_axial_stress`, `beam_shear_stress`, `beam_plastic_strain`, `beam_axial_strain`.
///
/// Components of stress and strain: xx, yy, zz, xy, yz, zx. Units are those of the run; the file does not tell them.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Field {
    /// Its name, such as `coordinates` or `shell`.
    pub name: &'static str,
    /// How many nodes, elements, particles …
    pub rows: u64,
    /// Words each.
    pub columns: u64,
    /// Words before it in the state.
    pub(crate) offset: u64,
}

/// What the manual leaves open or writers do differently.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Variant {
    rigid_shells: u64,
    penetration: bool,
    contact_energy: bool,
    kinetic_energy: bool,
    solid_thermal: bool,
    /// NDIM 8, 9: nodal blocks hold the active nodes only.
    active_only: bool,
    rigid_motion: u64,
    sph_words: u64,
    deletion: DeletionTable,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum DeletionTable {
    Full,
    WithoutRigidShells,
    Absent,
}

/// Where everything stands in a state.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    pub(crate) fields: Vec<Field>,
    /// Words of a whole state.
    pub(crate) words: u64,
    /// Shells without words in this layout.
    pub(crate) rigid_shells: u64,
}

impl Layout {
    pub(crate) fn field(&self, name: &str) -> Option<&Field> {
        self.fields.iter().find(|field| field.name == name)
    }
}

impl Variant {
    /// The layout as the manual has it.
    pub(crate) fn by_the_manual(control: &Control, reading: &Reading) -> Variant {
        Variant {
            rigid_shells: reading.rigid_shells,
            penetration: true,
            contact_energy: true,
            kinetic_energy: true,
            solid_thermal: true,
            active_only: true,
            rigid_motion: match control.ndim {
                8 => 24,
                9 => 12,
                _ => 0,
            },
            sph_words: reading.sph_words,
            deletion: DeletionTable::Full,
        }
    }

    /// Layouts that differ from it in one thing or two, each with the words to report it by.
    pub(crate) fn alternatives(self, reading: &Reading) -> Vec<(Variant, String)> {
        let listed = reading.geometry.rigid_shells.iter().filter(|rigid| **rigid).count() as u64;
        type Change = (&'static str, fn(&mut Variant, u64));
        const CHANGES: [Change; 11] = [
            ("rigid shells have words", |v, _| v.rigid_shells = 0),
            ("rigid shells counted by their material", |v, listed| v.rigid_shells = listed),
            ("no contact penetration", |v, _| v.penetration = false),
            ("no contact energy", |v, _| v.contact_energy = false),
            ("no kinetic energy", |v, _| v.kinetic_energy = false),
            ("no thermal words of solids", |v, _| v.solid_thermal = false),
            ("nodes of rigid bodies have words", |v, _| v.active_only = false),
            ("no motion of rigid bodies", |v, _| v.rigid_motion = 0),
            ("one word less for a particle", |v, _| v.sph_words = v.sph_words.saturating_sub(1)),
            ("rigid shells left out of the deletion table", |v, _| v.deletion = DeletionTable::WithoutRigidShells),
            ("no deletion table", |v, _| v.deletion = DeletionTable::Absent),
        ];
        let mut all: Vec<(Variant, String)> = Vec::new();
        let mut add = |variant: Variant, reason: String| {
            if variant != self && !all.iter().any(|(known, _)| *known == variant) {
                all.push((variant, reason));
            }
        };
        for (reason, change) in CHANGES {
            let mut one = self;
            change(&mut one, listed);
            add(one, reason.to_owned());
        }
        for (index, (first, change)) in CHANGES.iter().enumerate() {
            for (second, other) in &CHANGES[index + 1..] {
                let mut two = self;
                change(&mut two, listed);
                other(&mut two, listed);
                add(two, format!("{first}, {second}"));
            }
        }
        all
    }

    /// The blocks of a state; `None` if they are longer than anything can be.
    pub(crate) fn layout(self, control: &Control, reading: &Reading) -> Option<Layout> {
        let nodes = control.nodes;
        let moving = match &reading.active {
            Some(active) if self.active_only => active.len() as u64,
            _ => nodes,
        };
        let if_set = |flag: bool, words: u64| if flag { words } else { 0 };
        let digit = |place: u32| control.idtdt / 10_i64.pow(place) % 10;
        let space = control.dimensions();
        let rigid_shells = self.rigid_shells.min(control.shells);
        let position = if control.iu == 2 { "displacement" } else { "coordinates" };
        let node_deletion = if_set(control.mdlopt == 1 && self.deletion != DeletionTable::Absent, nodes);
        let elements = control
            .solids
            .checked_add(control.thick_shells)?
            .checked_add(control.shells)?
            .checked_add(control.beams)?;
        let element_deletion = match (control.mdlopt, self.deletion) {
            (2, DeletionTable::Full) => elements,
            (2, DeletionTable::WithoutRigidShells) => elements - rigid_shells,
            _ => 0,
        };
        let table = [
            ("time", 1, 1),
            ("globals", 1, control.globals),
            (position, moving, if_set(control.iu > 0, space)),
            ("temperature", nodes, [0, 1, 1, 3][control.temperature as usize]),
            ("heat_flux", nodes, if_set(control.temperature >= 2, 3)),
            ("mass_scaling", nodes, if_set(control.mass_scaling, 1)),
            ("temperature_rate", nodes, if_set(digit(0) == 1, 1)),
            ("residual_force", nodes, if_set(digit(1) == 1, 3)),
            ("residual_moment", nodes, if_set(digit(1) == 1, 3)),
            ("contact_penetration", nodes, if_set(self.penetration, control.penetration)),
            ("contact_energy", nodes, if_set(self.contact_energy && control.contact_energy, 1)),
            ("kinetic_energy", nodes, if_set(self.kinetic_energy && control.kinetic_energy, 1)),
            ("velocity", moving, if_set(control.velocity, space)),
            ("acceleration", moving, if_set(control.acceleration, space)),
            ("solid_thermal", control.solids, if_set(self.solid_thermal, control.nt3d)),
            ("solid", control.solids, control.nv3d),
            ("thick_shell", control.thick_shells, control.nv3dt),
            ("beam", control.beams, control.nv1d),
            ("shell", control.shells - rigid_shells, control.nv2d),
            ("node_deletion", node_deletion, 1),
            ("element_deletion", element_deletion, 1),
            ("sph", control.sph, self.sph_words),
            ("airbag", control.airbags, reading.airbags.words_in_state),
            ("airbag_particle", reading.airbags.particles, reading.airbags.words_of_particle),
            ("road", reading.road_surfaces, 6),
            ("rigid_motion", reading.rigid_bodies, self.rigid_motion),
        ];
        let (mut fields, mut offset) = (Vec::new(), 0_u64);
        for (name, rows, columns) in table {
            let words = rows.checked_mul(columns)?;
            if words > 0 {
                fields.push(Field { name, rows, columns, offset });
            }
            offset = offset.checked_add(words)?;
        }
        // bytes must be countable, too
        offset.checked_mul(control.words.size())?;
        Some(Layout { fields, words: offset, rigid_shells })
    }
}
