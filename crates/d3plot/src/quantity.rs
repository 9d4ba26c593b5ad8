//! What the words of an element are: stress, plastic strain, histories, forces, thickness, energy, strains by place.
//!
//! One table for reading and writing. Rows are stepped over by the words that the control block gives an element, never by
//! what is labelled here: a quantity that does not fit into them is not labelled.

use crate::control::Control;

/// Where a quantity lies in the words of an element: at `at`, `at + each`, … for each of its points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Quantity {
    /// The table of the state that holds it.
    pub(crate) table: &'static str,
    /// `shell_stress`, …
    pub(crate) name: &'static str,
    pub(crate) points: usize,
    /// Words from one point to the next.
    pub(crate) each: usize,
    /// Words before it.
    pub(crate) at: usize,
    /// Words a point.
    pub(crate) width: usize,
}

impl Quantity {
    /// Values an element.
    pub(crate) fn columns(&self) -> usize {
        self.points * self.width
    }

    /// Words of the element up to its end.
    fn end(&self) -> u64 {
        let last = (self.points as u64).saturating_sub(1).saturating_mul(self.each as u64);
        last.saturating_add(self.at as u64).saturating_add(self.width as u64)
    }
}

/// Every quantity of every element kind that the control block tells the place of.
pub(crate) fn quantities(control: &Control) -> Vec<Quantity> {
    let mut all = layered(control, SHELL, control.nv2d, true);
    all.extend(layered(control, THICK_SHELL, control.nv3dt, false));
    all.extend(solid(control));
    all.extend(beam(control));
    all.retain(|quantity| quantity.points > 0 && quantity.width > 0);
    all
}

/// Names of what shells and thick shells have in common, in the order of the words.
struct Layered {
    table: &'static str,
    stress: &'static str,
    plastic_strain: &'static str,
    history: &'static str,
    strain: &'static str,
    energy: &'static str,
}

const SHELL: Layered = Layered {
    table: "shell",
    stress: "shell_stress",
    plastic_strain: "shell_plastic_strain",
    history: "shell_history",
    strain: "shell_strain",
    energy: "shell_internal_energy",
};

const THICK_SHELL: Layered = Layered {
    table: "thick_shell",
    stress: "thick_shell_stress",
    plastic_strain: "thick_shell_plastic_strain",
    history: "thick_shell_history",
    strain: "thick_shell_strain",
    energy: "thick_shell_internal_energy",
};

/// Layers of (stress 6, plastic strain 1, histories), then, of shells alone, resultants 8 and thickness 1 with two words
/// that depend on the element, then strains 6 inner and 6 outer, and the internal energy last of the thickness words.
fn layered(control: &Control, names: Layered, words: u64, is_shell: bool) -> Vec<Quantity> {
    let Ok(layers) = usize::try_from(control.layers) else { return Vec::new() };
    let (stress, strain) = (if control.shell_stress { 6 } else { 0 }, usize::from(control.shell_strain));
    let each = stress + strain + control.neips as usize;
    let behind = layers.saturating_mul(each);
    if behind as u64 > words {
        return Vec::new();
    }
    let table = names.table;
    let point = |name, at, width| Quantity { table, name, points: layers, each, at, width };
    let one = |name, at, width| Quantity { table, name, points: 1, each: width, at, width };
    let mut all = vec![
        point(names.stress, 0, stress),
        point(names.plastic_strain, stress, strain),
        point(names.history, stress + strain, control.neips as usize),
    ];
    let strains = strains(control);
    // TSHENG, which files of R14 do not say
    let thick_energy = !is_shell && words == behind as u64 + if strains { 13 } else { 1 };
    let mut at = behind;
    let mut next = |name, width: usize| {
        let quantity = one(name, at, width);
        at = at.saturating_add(width);
        quantity
    };
    if is_shell && control.shell_resultants {
        all.push(next("shell_bending_moment", 3));
        all.push(next("shell_shear_force", 2));
        all.push(next("shell_normal_force", 3));
    }
    if is_shell && control.shell_thickness {
        all.push(next("shell_thickness", 1));
        all.push(next("shell_element_variable", 2));
    }
    if strains {
        all.push(next(names.strain, 12));
    }
    if is_shell && control.shell_thickness || thick_energy {
        all.push(next(names.energy, 1));
    }
    if is_shell && digit(control, 2) {
        all.push(next("shell_plastic_strain_tensor", 18));
    }
    if is_shell && digit(control, 3) {
        all.push(next("shell_thermal_strain", 6));
    }
    all.retain(|quantity| quantity.end() <= words);
    all
}

/// ISTRN: whether strains are written. From IDTDT = 100 on a digit of it says so; below, what is left of a shell.
pub(crate) fn strains(control: &Control) -> bool {
    if control.idtdt >= 100 {
        return digit(control, 4);
    }
    let each = u64::from(control.shell_stress) * 6 + u64::from(control.shell_strain) + control.neips;
    let layers = control.layers.saturating_mul(each);
    let behind = u64::from(control.shell_resultants) * 8 + u64::from(control.shell_thickness) * 4;
    match control.nv2d {
        0 => control.nv3dt > layers.saturating_add(1),
        words => words > layers.saturating_add(behind).saturating_add(1),
    }
}

fn digit(control: &Control, place: u32) -> bool {
    control.idtdt / 10_i64.pow(place) % 10 == 1
}

/// 1 or 8 points of (stress 6, plastic strain 1, histories); where strains are written they are the last six histories.
fn solid(control: &Control) -> Vec<Quantity> {
    let (stress, strain) = (if control.solid_stress { 6 } else { 0 }, usize::from(control.solid_strain));
    let told = stress + strain + control.neiph as usize;
    if told == 0 {
        return Vec::new();
    }
    let words = control.nv3d as usize;
    let points = if words / 8 >= told { 8 } else { 1 };
    // the words there are, not those there should be
    let each = words / points;
    let quantity = |name, at, width| Quantity { table: "solid", name, points, each, at, width };
    let mut all = vec![
        quantity("solid_stress", 0, stress),
        quantity("solid_plastic_strain", stress, strain),
        quantity("solid_history", stress + strain, control.neiph as usize),
    ];
    // with tensors of plastic or thermal strain among the histories the manual does not say which come last
    let tensors = digit(control, 2) || digit(control, 3);
    if control.neiph >= 6 && strains(control) && !tensors {
        all.push(quantity("solid_strain", told - 6, 6));
    }
    all.retain(|quantity| quantity.at + quantity.width <= each);
    all
}

/// Six forces, then 5 words for each integration point, then histories. That the axial stress comes first of the five is measured:
/// in a family of 544 beams its mean over the points follows the axial force (correlation 0.9997), the next two words the shear forces.
fn beam(control: &Control) -> Vec<Quantity> {
    let quantity = |name, points, each, at, width| Quantity { table: "beam", name, points, each, at, width };
    let mut all = vec![
        quantity("beam_axial_force", 1, 1, 0, 1),
        quantity("beam_shear_force", 1, 2, 1, 2),
        quantity("beam_bending_moment", 1, 2, 3, 2),
        quantity("beam_torsion_moment", 1, 1, 5, 1),
    ];
    if let Some(points) = beam_points(control) {
        all.push(quantity("beam_axial_stress", points, 5, 6, 1));
        all.push(quantity("beam_shear_stress", points, 5, 7, 2));
        all.push(quantity("beam_plastic_strain", points, 5, 9, 1));
        all.push(quantity("beam_axial_strain", points, 5, 10, 1));
    }
    all.retain(|quantity| quantity.end() <= control.nv1d);
    all
}

/// BEAMIP out of NV1D = 6 + 5 BEAMIP + NEIPB (3 + BEAMIP).
pub(crate) fn beam_points(control: &Control) -> Option<usize> {
    let rest = control.nv1d.checked_sub(6)?.checked_sub(control.neipb.checked_mul(3)?)?;
    let each = 5 + control.neipb;
    usize::try_from(rest / each).ok().filter(|_| rest.is_multiple_of(each))
}
