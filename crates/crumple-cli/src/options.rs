//! Options that several commands share, and what they mean to the library. Defaults live there, not here.

use std::path::PathBuf;

use clap::Args;
use crumple::Error;
use crumple::basis::BasisOptions;
use crumple::descriptor::{DescribeOptions, Select, Threshold};
use crumple::inputs::Table;
use crumple::modes::ModesOptions;
use crumple::similarity::SimilarityOptions;
use crumple::study::Rows;
use crumple::{OperatorOptions, UnknownName};

/// The operator.
#[derive(Args)]
pub(crate) struct OperatorArgs {
    /// Discretisation of the Laplacian: cotan, tufted (any faces, no negative weights; for meshes that are non-manifold
    /// or badly shaped) or polygon (quads without choosing a diagonal) [default: cotan]
    #[arg(long, value_name = "OPERATOR")]
    operator: Option<String>,
    /// Mass matrix: lumped (a third of each triangle's area to each corner), consistent (not diagonal; slower) or
    /// identity (every vertex the same, as the paper's formula has it) [default: lumped]
    #[arg(long, value_name = "MASS")]
    mass: Option<String>,
    /// Treat separate sheets as one: mutually nearest vertices of different pieces of the mesh that are closer than this
    /// (length unit of the model) share one degree of freedom. A distance is recommended where sheets lie close
    #[arg(long, value_name = "DISTANCE", allow_negative_numbers = true)]
    join: Option<f64>,
}

impl OperatorArgs {
    pub(crate) fn options(&self) -> Result<OperatorOptions, Error> {
        let wrong =
            |name| move |error: UnknownName| Error::Value { name, value: error.name, expected: error.expected.into() };
        let kind = self.operator.as_deref().map(str::parse).transpose().map_err(wrong("--operator"))?;
        let mass = self.mass.as_deref().map(str::parse).transpose().map_err(wrong("--mass"))?;
        Ok(OperatorOptions { join: self.join, kind: kind.unwrap_or_default(), mass: mass.unwrap_or_default() })
    }
}

/// The surface and its eigenbasis.
#[derive(Args)]
pub(crate) struct BasisArgs {
    /// Part whose shells make the surface, by id or title; may be given several times [default: all shells]
    #[arg(long = "part", value_name = "PART")]
    pub(crate) parts: Vec<String>,
    #[command(flatten)]
    operator: OperatorArgs,
    /// Eigenpairs K of the basis, 1 or more; each costs time and space, and resolves finer folds [default: 500]
    #[arg(short = 'K', long, value_name = "K", allow_negative_numbers = true)]
    eigenpairs: Option<usize>,
}

impl BasisArgs {
    pub(crate) fn options(&self) -> Result<BasisOptions, Error> {
        let default = BasisOptions::default();
        let eigenpairs = self.eigenpairs.unwrap_or(default.eigenpairs);
        Ok(BasisOptions { eigenpairs, operator: self.operator.options()? })
    }
}

/// Adding runs.
#[derive(Args)]
pub(crate) struct AddArgs {
    /// Table (CSV) of inputs or responses, kept per run: the run in the first column, by id or by its number
    #[arg(long, value_name = "CSV")]
    params: Option<PathBuf>,
    /// Leave out runs that cannot be read or that have another mesh, instead of adding nothing
    #[arg(long)]
    pub(crate) skip_bad: bool,
    /// A run whose id is there with another content takes its place
    #[arg(long)]
    pub(crate) replace: bool,
}

impl AddArgs {
    pub(crate) fn table(&self) -> Result<Option<Table>, Error> {
        self.params.as_deref().map(Table::read).transpose()
    }
}

/// Grouping into modes.
#[derive(Args)]
pub(crate) struct ModesArgs {
    /// Number of modes, 1 or more [default: the number from 2 to 8 with the best mean silhouette]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    count: Option<usize>,
    /// Seed of the random starts; the same seed gives the same modes [default: 1]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    seed: Option<u64>,
    /// What makes runs alike: `rotation`, the kind and direction of the deformation wherever it happens, or
    /// `displacement`, where every place ends up, as in the paper [default: rotation]
    #[arg(long, value_name = "WHAT")]
    by: Option<String>,
    /// How to group: kmeans, ward or average [default: kmeans]
    #[arg(long, value_name = "METHOD")]
    method: Option<String>,
}

impl ModesArgs {
    pub(crate) fn options(&self) -> Result<ModesOptions, Error> {
        let default = ModesOptions::default();
        let method = self.method.as_deref().map(str::parse).transpose()?;
        let by = self.by.as_deref().map(str::parse).transpose()?.unwrap_or(default.by);
        Ok(ModesOptions {
            count: self.count,
            seed: self.seed.unwrap_or(default.seed),
            method: method.unwrap_or(default.method),
            by,
        })
    }
}

/// Building a descriptor.
#[derive(Args)]
pub(crate) struct DescribeArgs {
    /// What makes an eigenvector matter: large coefficients of the `coordinates`, or a large `difference` to the
    /// undeformed part [default: coordinates]
    #[arg(long, value_name = "WHAT")]
    select: Option<String>,
    /// How large is large: std:C (mean + C standard deviations; the paper's is std:1), mean:C, value:T, top:M (the M
    /// largest), energy:SHARE, error:MM (as many as the reconstruction needs to be that close) [default: std:1]
    #[arg(long, value_name = "RULE")]
    threshold: Option<String>,
}

impl DescribeArgs {
    /// What was asked for; `None` where nothing was.
    pub(crate) fn asked(&self) -> Result<Option<DescribeOptions>, Error> {
        let options = self.options()?;
        Ok((self.select.is_some() || self.threshold.is_some()).then_some(options))
    }

    pub(crate) fn options(&self) -> Result<DescribeOptions, Error> {
        let select = select(self.select.as_deref())?;
        let threshold: Option<Threshold> = self.threshold.as_deref().map(str::parse).transpose()?;
        Ok(DescribeOptions { select, threshold: threshold.unwrap_or_default() })
    }
}

/// Comparing with a descriptor.
#[derive(Args)]
pub(crate) struct SimilarityArgs {
    /// The measure: cosine (the paper's), euclidean (RMS distance in the length unit) or mahalanobis [default: cosine]
    #[arg(long, value_name = "METRIC")]
    metric: Option<String>,
    /// Compare differences from the mean of all runs, not the coefficients themselves
    #[arg(long)]
    centred: bool,
    /// Weights of the coefficients: none, frequency (√λ) or spread (1 / standard deviation) [default: none]
    #[arg(long, value_name = "WEIGHT")]
    weight: Option<String>,
}

impl SimilarityArgs {
    pub(crate) fn options(&self) -> Result<SimilarityOptions, Error> {
        let metric = self.metric.as_deref().map(str::parse).transpose()?.unwrap_or_default();
        let weight = self.weight.as_deref().map(str::parse).transpose()?.unwrap_or_default();
        Ok(SimilarityOptions { centred: self.centred, weight, metric })
    }
}

/// `coordinates` or `difference`.
pub(crate) fn select(text: Option<&str>) -> Result<Select, Error> {
    match text {
        None => Ok(Select::default()),
        Some("coordinates") => Ok(Select::Coordinates),
        Some("difference") => Ok(Select::Difference),
        Some(other) => {
            Err(Error::Value { name: "--select", value: other.into(), expected: "coordinates or difference".into() })
        }
    }
}

/// `last` or `all`.
pub(crate) fn rows(text: Option<&str>) -> Result<Rows<'static>, Error> {
    match text {
        None | Some("last") => Ok(Rows::Last),
        Some("all") => Ok(Rows::All),
        Some(other) => Err(Error::Value { name: "--states", value: other.into(), expected: "last or all".into() }),
    }
}
