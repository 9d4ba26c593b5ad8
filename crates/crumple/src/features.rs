//! What of a state is compared: from stored coefficients to the few numbers of a descriptor.
//!
//! Two kinds. The paper's: the values of the coordinates, of the displacement or of a field on the descriptor's
//! eigenvectors. The rotation spectrum: how much the surface turned at which wavelength, and which way it turned as a
//! whole ([`crate::rotation::Ruler`]). Search, verify, classify, monitor and the optimiser's number compare these
//! numbers and nothing else.

use rayon::prelude::*;

use crate::Error;
use crate::basis::Basis;
use crate::descriptor::{Descriptor, Selected};
use crate::rotation::{OCTAVES, Ruler};
use crate::select::{Kind, Select};
use crate::study::{Coefficients, Function, Need, Rows, Stored, Study, column_name, triples};
use crate::target::Target;
use crate::vector::unit;

/// From coefficients to the numbers that are compared.
#[derive(Debug, Clone)]
pub struct Features {
    needs: Vec<Need>,
    blocks: Vec<Block>,
}

#[derive(Debug, Clone)]
enum Block {
    /// Values on a descriptor's eigenvectors: (stored + offset) · scale.
    Values { offset: Vec<f64>, scale: f64, frequencies: Vec<f64> },
    /// The rotation spectrum.
    Spectrum(Ruler),
    /// Its kind alone.
    Kind(Ruler),
}

impl Features {
    /// The numbers that a descriptor compares under a kind.
    ///
    /// # Errors
    /// [`Error::Value`] if it names an eigenvector that the basis does not have.
    pub fn of(basis: &Basis, descriptor: &Descriptor, kind: Kind) -> Result<Self, Error> {
        match kind {
            Kind::Rotation => {
                let (mut features, ruler) = (Self::rotation(basis), Ruler::of(basis));
                let (found, expected) = (descriptor.spectrum.direction.len(), ruler.directions());
                if found == 0 {
                    // A descriptor of another part: its direction means nothing here.
                    features.blocks = vec![Block::Kind(ruler)];
                } else if found != expected {
                    return Err(Error::Value {
                        name: "descriptor",
                        value: format!("a direction of {found} triples"),
                        expected: format!("{expected} in this study"),
                    });
                }
                Ok(features)
            }
            Kind::Paper => {
                let blocks: Vec<Block> =
                    descriptor.blocks().map(|selected| values_block(basis, selected)).collect::<Result<_, _>>()?;
                let needs = descriptor.blocks().map(|selected| Need {
                    function: selected.function(),
                    eigenvectors: Some(selected.eigenvectors.clone()),
                });
                Ok(Self { needs: needs.collect(), blocks })
            }
        }
    }

    /// The rotation spectrum in a basis.
    pub fn rotation(basis: &Basis) -> Self {
        Self {
            needs: vec![Need { function: Function::Rotation, eigenvectors: None }],
            blocks: vec![Block::Spectrum(Ruler::of(basis))],
        }
    }

    /// All coefficients of the displacement.
    pub fn displacement(basis: &Basis) -> Self {
        let all = 3 * basis.eigenpairs();
        let frequencies = basis.eigenvalues.iter().flat_map(|eigenvalue| [eigenvalue.max(0.0).sqrt(); 3]).collect();
        Self {
            needs: vec![Need { function: Function::Displacement, eigenvectors: None }],
            blocks: vec![Block::Values { offset: vec![0.0; all], scale: 1.0, frequencies }],
        }
    }

    /// What has to be read, one entry for each slice that [`Features::vector`] takes.
    pub fn needs(&self) -> &[Need] {
        &self.needs
    }

    /// Reads what is needed of these rows; the results have the same rows in the same order.
    ///
    /// # Errors
    /// As [`Study::coefficients_of`].
    pub fn read(&self, study: &Study, rows: Rows<'_>) -> Result<Samples, Error> {
        let read = |need: &Need| study.coefficients_of(need.function, need.eigenvectors.as_deref(), rows);
        Ok(Samples { blocks: self.needs.iter().map(read).collect::<Result<_, _>>()? })
    }

    /// What is needed of a state that was named or projected: one row.
    ///
    /// # Errors
    /// [`Error::UnknownField`] if it lacks what is compared.
    pub fn sample(&self, target: &Target) -> Result<Samples, Error> {
        Ok(Samples { blocks: self.needs.iter().map(|need| target.on(need)).collect::<Result<_, _>>()? })
    }

    /// Every row as a direction: its run, and the numbers that are compared, of length 1.
    pub(crate) fn directions(&self, samples: &Samples) -> Vec<(String, Vec<f64>)> {
        let direction = |row: usize| (samples.run(row).to_owned(), unit(self.vector(&samples.stored(row))));
        (0..samples.rows()).into_par_iter().map(direction).collect()
    }

    /// The numbers that are compared. `stored`: one entry for each need.
    pub fn vector(&self, stored: &[Stored<'_>]) -> Vec<f64> {
        let numbers = |(block, stored): (&Block, &Stored<'_>)| match block {
            Block::Values { offset, scale, .. } => {
                stored.values.iter().zip(offset).map(|(&x, offset)| (f64::from(x) + offset) * scale).collect()
            }
            Block::Spectrum(ruler) => ruler.spectrum(&triples(stored.values), stored.rms).numbers(),
            Block::Kind(ruler) => ruler.spectrum(&triples(stored.values), stored.rms).kind,
        };
        self.blocks.iter().zip(stored).flat_map(numbers).collect::<Vec<f64>>()
    }

    /// The numbers of a descriptor's target.
    pub fn target(&self, descriptor: &Descriptor) -> Vec<f64> {
        match self.blocks.first() {
            Some(Block::Spectrum(_) | Block::Kind(_)) => descriptor.spectrum.numbers(),
            _ => descriptor
                .blocks()
                .flat_map(|selected| selected.values.iter().flatten().map(move |x| x * selected.scale))
                .collect(),
        }
    }

    /// Names of the numbers, stable: the names of the study's columns, or `kind_1` …, `turn_1_x` ….
    pub fn names(&self) -> Vec<String> {
        let of = |(block, need): (&Block, &Need)| match block {
            Block::Values { offset, .. } => {
                let components = need.function.components();
                let all = || (1..=offset.len() / components).collect();
                let eigenvectors: Vec<usize> = need.eigenvectors.clone().unwrap_or_else(all);
                eigenvectors
                    .into_iter()
                    .flat_map(|j| (0..components).map(move |c| (j, c)))
                    .map(|(j, c)| column_name(need.function, j, c))
                    .collect()
            }
            Block::Spectrum(ruler) => ruler.names(),
            Block::Kind(ruler) => ruler.names()[..OCTAVES].to_vec(),
        };
        self.blocks.iter().zip(&self.needs).flat_map(of).collect::<Vec<String>>()
    }

    /// For each need the numbers as (stored + offset) · factor; `None` where they are made from stored ones in another way.
    pub(crate) fn affine(&self) -> Option<Vec<(f64, &[f64])>> {
        let of = |block| match block {
            &Block::Values { ref offset, scale, .. } => Some((scale, &offset[..])),
            Block::Spectrum(_) | Block::Kind(_) => None,
        };
        self.blocks.iter().map(of).collect()
    }

    /// √λ of each number's eigenvector; `None` where numbers are not of one eigenvector.
    pub(crate) fn frequencies(&self) -> Option<Vec<f64>> {
        let of = |block: &Block| match block {
            Block::Values { frequencies, .. } => Some(frequencies.clone()),
            Block::Spectrum(_) | Block::Kind(_) => None,
        };
        Some(self.blocks.iter().map(of).collect::<Option<Vec<_>>>()?.concat())
    }
}

fn values_block(basis: &Basis, selected: &Selected) -> Result<Block, Error> {
    let (j, function) = (&selected.eigenvectors, selected.function());
    if let Some(&beyond) = j.iter().find(|&&j| j > basis.eigenpairs()) {
        return Err(Error::Value {
            name: "descriptor",
            value: format!("eigenvector {beyond}"),
            expected: format!("at most {}", basis.eigenpairs()),
        });
    }
    let components = function.components();
    let offset = match (function, selected.select) {
        (Function::Displacement, Select::Coordinates) => j.iter().flat_map(|&j| basis.baseline[j - 1]).collect(),
        _ => vec![0.0; components * j.len()],
    };
    let frequency = |&j: &usize| std::iter::repeat_n(basis.eigenvalues[j - 1].max(0.0).sqrt(), components);
    Ok(Block::Values { offset, scale: selected.scale, frequencies: j.iter().flat_map(frequency).collect() })
}

/// Coefficients of the same states, block by block.
#[derive(Debug, Clone)]
pub struct Samples {
    blocks: Vec<Coefficients>,
}

impl Samples {
    /// Number of states.
    pub fn rows(&self) -> usize {
        self.blocks.first().map_or(0, Coefficients::rows)
    }

    /// Run id of a row.
    pub fn run(&self, row: usize) -> &str {
        &self.blocks[0].runs[row]
    }

    /// State of a row, counted from 0.
    pub fn state(&self, row: usize) -> u32 {
        self.blocks[0].states[row]
    }

    /// Time of a row.
    pub fn time(&self, row: usize) -> f64 {
        self.blocks[0].times[row]
    }

    /// What [`Features::vector`] takes.
    pub fn stored(&self, row: usize) -> Vec<Stored<'_>> {
        self.blocks.iter().map(|block| block.stored(row)).collect()
    }

    /// The coefficients of each need.
    pub fn blocks(&self) -> &[Coefficients] {
        &self.blocks
    }

    /// The coefficients of the first need.
    pub fn first(&self) -> Option<&Coefficients> {
        self.blocks.first()
    }
}
