//! What each state of a written family holds, and the control block that says so.

use crate::control::Control;
use crate::detect::FileType;
use crate::elements::Geometry;
use crate::family::Family;
use crate::quantity::{beam_points, strains};
use crate::words::Words;

/// What every state of a family holds; the format fixes it once for all states. The default is positions of the nodes
/// and nothing else.
///
/// ```
/// use d3plot::{Content, Stored};
///
/// let content = Content { plastic_strain: Stored::All, layers: 3, velocity: true, ..Content::default() };
/// # let _ = content;
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Content {
    /// Global words of a state (NGLBV): energies and velocities of the model, then of the parts.
    pub globals: usize,
    /// Where the nodes are.
    pub positions: Positions,
    /// Temperatures of the nodes and heat flux.
    pub thermal: Thermal,
    /// A word of mass scaling a node.
    pub mass_scaling: bool,
    /// Rate of temperature, one word a node.
    pub temperature_rate: bool,
    /// Residual forces and moments, six words a node.
    pub residual_forces: bool,
    /// Contact penetration: 0, 3 or 6 words a node.
    pub contact_penetration: usize,
    /// Contact energy, one word a node.
    pub contact_energy: bool,
    /// Kinetic energy, one word a node.
    pub kinetic_energy: bool,
    /// Velocities of the nodes.
    pub velocity: bool,
    /// Accelerations of the nodes.
    pub acceleration: bool,
    /// Thermal words a solid (NT3D).
    pub solid_thermal: usize,
    /// Points through the thickness of shells and thick shells, whose order is mid, inner, outer surface, others.
    pub layers: usize,
    /// The layers count four points in the plane of each shell (NUMDS < 0).
    pub in_plane_points: bool,
    /// Stress tensor of each point of shells, thick shells and solids, six words.
    pub stress: Stored,
    /// Effective plastic strain of each point.
    pub plastic_strain: Stored,
    /// History variables of a layer (NEIPS).
    pub histories: usize,
    /// Bending moments, shear forces and normal forces of shells, eight words.
    pub resultants: bool,
    /// Thickness of shells, two words that depend on the element, internal energy: four words.
    pub thickness: bool,
    /// Strain tensors at the inner and outer surface of shells and thick shells, twelve words.
    pub strains: bool,
    /// Integration points of a solid: 1 or 8.
    pub solid_points: usize,
    /// History variables of a point of a solid (NEIPH).
    pub solid_histories: usize,
    /// Forces and moments of beams, six words.
    pub beam_forces: bool,
    /// Integration points of a beam (BEAMIP), five words each behind its forces.
    pub beam_points: usize,
    /// History variables of a beam (NEIPB): 3 + BEAMIP words each behind its points.
    pub beam_histories: usize,
    /// Words an element where they are more than the above need; the further ones have no name and come last.
    pub words: WordsEach,
    /// A table of what is deleted.
    pub deletion: DeletionTable,
    /// Lengths of what an SPH particle has (isphfg), the first the length of the list. Needed where there are particles.
    pub sph_flags: Vec<i64>,
    /// Plastic strain tensors of shells at three places, eighteen words (hundreds of IDTDT).
    pub plastic_strain_tensor: bool,
    /// Thermal strain tensor of shells, six words (thousands of IDTDT).
    pub thermal_strain: bool,
}

/// How the states hold positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Positions {
    /// Not at all (IU = 0).
    None,
    /// As they are (IU = 1).
    #[default]
    Coordinates,
    /// As displacements from where the nodes start (IU = 2).
    Displacements,
}

/// What the states hold of heat in the nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Thermal {
    /// Nothing.
    #[default]
    None,
    /// One temperature.
    Temperature,
    /// One temperature and the heat flux, three words.
    TemperatureAndFlux,
    /// Three temperatures (through the thickness) and the heat flux.
    ThreeTemperaturesAndFlux,
}

/// For which elements the points hold something.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stored {
    /// For none.
    #[default]
    No,
    /// For solids alone.
    Solids,
    /// For solids, shells and thick shells.
    All,
}

/// What the deletion table has a word for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DeletionTable {
    /// There is none.
    #[default]
    None,
    /// Nodes (MDLOPT 1).
    Nodes,
    /// Elements (MDLOPT 2).
    Elements,
}

/// Words an element of each kind; 0 for as many as its quantities need.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct WordsEach {
    /// Of a solid (NV3D).
    pub solid: usize,
    /// Of a thick shell (NV3DT).
    pub thick_shell: usize,
    /// Of a beam (NV1D).
    pub beam: usize,
    /// Of a shell (NV2D).
    pub shell: usize,
}

impl Default for Content {
    fn default() -> Content {
        Content {
            globals: 0,
            positions: Positions::Coordinates,
            thermal: Thermal::None,
            mass_scaling: false,
            temperature_rate: false,
            residual_forces: false,
            contact_penetration: 0,
            contact_energy: false,
            kinetic_energy: false,
            velocity: false,
            acceleration: false,
            solid_thermal: 0,
            layers: 3,
            in_plane_points: false,
            stress: Stored::No,
            plastic_strain: Stored::No,
            histories: 0,
            resultants: false,
            thickness: false,
            strains: false,
            solid_points: 1,
            solid_histories: 0,
            beam_forces: false,
            beam_points: 0,
            beam_histories: 0,
            words: WordsEach::default(),
            deletion: DeletionTable::None,
            sph_flags: Vec::new(),
            plastic_strain_tensor: false,
            thermal_strain: false,
        }
    }
}

impl Content {
    /// What the states of an opened family hold, for writing them again. Airbag particles, road surfaces and the motion
    /// of rigid bodies are not among it: those tables are not written.
    pub fn of(family: &Family) -> Content {
        let control = &family.control;
        let columns = |table: &str| family.layout.field(table).map_or(0, |field| field.columns as usize);
        let has = |table: &str| columns(table) > 0;
        let stored = |shells: bool, solids: bool| match (shells, solids) {
            (true, _) => Stored::All,
            (false, true) => Stored::Solids,
            (false, false) => Stored::No,
        };
        let content = Content {
            globals: columns("globals"),
            positions: match (has("coordinates"), has("displacement")) {
                (true, _) => Positions::Coordinates,
                (_, true) => Positions::Displacements,
                _ => Positions::None,
            },
            thermal: match (columns("temperature"), has("heat_flux")) {
                (0, _) => Thermal::None,
                (3, _) => Thermal::ThreeTemperaturesAndFlux,
                (_, true) => Thermal::TemperatureAndFlux,
                (_, false) => Thermal::Temperature,
            },
            mass_scaling: has("mass_scaling"),
            temperature_rate: has("temperature_rate"),
            residual_forces: has("residual_force"),
            contact_penetration: columns("contact_penetration"),
            contact_energy: has("contact_energy"),
            kinetic_energy: has("kinetic_energy"),
            velocity: has("velocity") && !family.is_torn("velocity"),
            acceleration: has("acceleration") && !family.is_torn("acceleration"),
            solid_thermal: columns("solid_thermal"),
            layers: control.layers as usize,
            in_plane_points: control.in_plane_points,
            stress: stored(control.shell_stress, control.solid_stress),
            plastic_strain: stored(control.shell_strain, control.solid_strain),
            histories: control.neips as usize,
            resultants: control.shell_resultants,
            thickness: control.shell_thickness,
            strains: strains(control),
            solid_points: family.quantities.iter().find(|of| of.table == "solid").map_or(1, |of| of.points),
            solid_histories: control.neiph as usize,
            beam_forces: control.nv1d > 0,
            beam_points: beam_points(control).unwrap_or(0),
            beam_histories: control.neipb as usize,
            words: WordsEach::default(),
            deletion: match (has("node_deletion"), has("element_deletion")) {
                (true, _) => DeletionTable::Nodes,
                (_, true) => DeletionTable::Elements,
                _ => DeletionTable::None,
            },
            sph_flags: family.reading.sph_flags.clone(),
            plastic_strain_tensor: control.idtdt / 100 % 10 == 1,
            thermal_strain: control.idtdt / 1000 % 10 == 1,
        };
        let words = WordsEach {
            solid: columns("solid"),
            thick_shell: columns("thick_shell"),
            beam: columns("beam"),
            shell: columns("shell"),
        };
        Content { words, ..content }
    }

    /// Words an element of each kind: those its quantities need, or those that were asked for.
    fn words_each(&self) -> Result<WordsEach, String> {
        let (solid, shell) = (self.stress != Stored::No, self.stress == Stored::All);
        let (solid_strain, shell_strain) = (self.plastic_strain != Stored::No, self.plastic_strain == Stored::All);
        let point =
            |stress, strain, histories: usize| histories.checked_add(6 * usize::from(stress) + usize::from(strain));
        let tensors = 18 * usize::from(self.plastic_strain_tensor) + 6 * usize::from(self.thermal_strain);
        let needed = || {
            let layers = point(shell, shell_strain, self.histories)?.checked_mul(self.layers)?;
            let strains = 12 * usize::from(self.strains);
            let thickness = 4 * usize::from(self.thickness);
            let behind = 8 * usize::from(self.resultants) + thickness + strains + tensors;
            let of_point = self.beam_points.checked_add(3)?.checked_mul(self.beam_histories)?;
            let beam = self.beam_points.checked_mul(5)?.checked_add(6)?.checked_add(of_point)?;
            Some(WordsEach {
                solid: point(solid, solid_strain, self.solid_histories)?.checked_mul(self.solid_points)?,
                thick_shell: layers.checked_add(strains)?,
                beam: if self.beam_forces { beam } else { 0 },
                shell: layers.checked_add(behind)?,
            })
        };
        let needed = needed().ok_or("more words an element than can be counted")?;
        let asked = self.words;
        let pairs = [
            ("solid", asked.solid, needed.solid),
            ("thick shell", asked.thick_shell, needed.thick_shell),
            ("beam", asked.beam, needed.beam),
            ("shell", asked.shell, needed.shell),
        ];
        match pairs.iter().find(|(_, asked, needed)| (1..*needed).contains(asked)) {
            Some((kind, asked, needed)) => {
                Err(format!("{asked} words a {kind} asked for, its quantities need {needed}"))
            }
            None => {
                let [solid, thick_shell, beam, shell] = pairs.map(|(_, asked, needed)| asked.max(needed));
                Ok(WordsEach { solid, thick_shell, beam, shell })
            }
        }
    }

    /// The control block of a family with these contents; its title and what belongs to the geometry come from others.
    pub(super) fn control(&self, words: Words, geometry: &Geometry) -> Result<Control, String> {
        if !matches!(self.solid_points, 1 | 8) {
            return Err(format!("{} integration points a solid; the format has 1 or 8", self.solid_points));
        }
        if !matches!(self.contact_penetration, 0 | 3 | 6) {
            return Err(format!("{} words of contact penetration; the format has 0, 3 or 6", self.contact_penetration));
        }
        if self.layers > 9999 {
            return Err(format!("{} layers; the format counts to 9999", self.layers));
        }
        if !geometry.sph.is_empty() && self.sph_flags.is_empty() {
            return Err("SPH particles without the lengths of their results (Content::sph_flags)".to_owned());
        }
        let each = self.words_each()?;
        let count = |list: usize| list as u64;
        Ok(Control {
            words,
            file_type: FileType::D3plot,
            ndim: 4,
            nodes: count(geometry.coordinates.len()),
            globals: count(self.globals),
            temperature: self.thermal as i64,
            mass_scaling: self.mass_scaling,
            iu: self.positions as i64,
            velocity: self.velocity,
            acceleration: self.acceleration,
            solids: count(geometry.solids.len()),
            nv3d: count(each.solid),
            beams: count(geometry.beams.len()),
            nv1d: count(each.beam),
            shells: count(geometry.shells.len()),
            nv2d: count(each.shell),
            thick_shells: count(geometry.thick_shells.len()),
            nv3dt: count(each.thick_shell),
            neiph: count(self.solid_histories),
            neips: count(self.histories),
            in_plane_points: self.in_plane_points,
            layers: count(self.layers),
            mdlopt: self.deletion as u8,
            sph: count(geometry.sph.len()),
            shell_stress: self.stress == Stored::All,
            shell_strain: self.plastic_strain == Stored::All,
            solid_stress: self.stress != Stored::No,
            solid_strain: self.plastic_strain != Stored::No,
            shell_resultants: self.resultants,
            shell_thickness: self.thickness,
            idtdt: self.idtdt(),
            nt3d: count(self.solid_thermal),
            neipb: count(self.beam_histories),
            penetration: count(self.contact_penetration),
            contact_energy: self.contact_energy,
            kinetic_energy: self.kinetic_energy,
            ..Control::default()
        })
    }

    /// IDTDT, digit by digit. The one of the strains counts only beside tensors.
    fn idtdt(&self) -> i64 {
        let tensors = self.plastic_strain_tensor || self.thermal_strain;
        i64::from(self.temperature_rate)
            + 10 * i64::from(self.residual_forces)
            + 100 * i64::from(self.plastic_strain_tensor)
            + 1000 * i64::from(self.thermal_strain)
            + 10_000 * i64::from(tensors && self.strains)
    }
}
