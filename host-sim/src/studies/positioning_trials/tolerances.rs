//! What a tolerance costs: the same moves, asked for at several tolerances.

use super::tables::millidegrees;
use super::{PositioningTrialsPlan, Strategy, StrategyTrials};
use crate::report::document::Table;
use crate::report::page::PlacedValue;
use crate::studies::beside::BesideScene;
use simulation::runs::RunError;
use simulation::scene::Scene;

/// The tolerances in degrees, each with the number of marks that the camera tracks.
const ASKED: [(f64, u64); 5] = [(0.5e-3, 2), (0.35e-3, 2), (0.25e-3, 2), (0.2e-3, 8), (0.1e-3, 8)];

const HEADER: [&str; 11] = [
    "scene",
    "marks",
    "tolerance",
    "trials",
    "given up",
    "50 %",
    "95 %",
    "99.9 %",
    "worst",
    "settle s",
    "per bound",
];

/// The trials at one tolerance.
#[derive(Clone, Debug)]
struct AtTolerance {
    scene: String,
    marks: u64,
    tolerance_deg: f64,
    found: StrategyTrials,
}

/// The trials at each tolerance, on each scene.
#[derive(Clone, Debug)]
pub struct ToleranceTrials(Vec<AtTolerance>);

impl ToleranceTrials {
    /// The controller on each of `scenes`, with as many trials at each tolerance as stand beside it.
    ///
    /// # Errors
    /// When a scene is refused.
    pub fn run(scenes: &[(BesideScene, u64)]) -> Result<Self, RunError> {
        let each = scenes.iter().flat_map(|of| ASKED.iter().map(move |asked| (of, *asked)));
        let found = each.map(|((beside, trials), (tolerance_deg, marks))| {
            let scene = asked(&beside.scene, tolerance_deg, marks)?;
            let found = PositioningTrialsPlan::new(&scene, Strategy::Planned, *trials)?.run(&|_| ())?;
            Ok(AtTolerance { scene: beside.name.clone(), marks, tolerance_deg, found })
        });
        found.collect::<Result<_, RunError>>().map(Self)
    }

    /// The value of the page on positioning.
    pub fn page_value(&self) -> PlacedValue {
        let mut table = Table::new(&HEADER);
        self.0.iter().map(AtTolerance::cells).for_each(|cells| table.push(cells));
        ("table_tolerances", table.markdown())
    }
}

/// `scene`, asked for this tolerance with this number of marks.
fn asked(scene: &Scene, tolerance_deg: f64, marks: u64) -> Result<Scene, RunError> {
    let mut scene = scene.clone();
    scene.set("position.tolerance_deg", &tolerance_deg.to_string())?;
    scene.set("camera.marks", &marks.to_string())?;
    Ok(scene)
}

impl AtTolerance {
    fn cells(&self) -> Vec<String> {
        let summary = self.found.summary();
        let mut cells = vec![
            self.scene.clone(),
            self.marks.to_string(),
            millidegrees(1e3 * self.tolerance_deg),
            summary.trials.to_string(),
            summary.given_up.to_string(),
        ];
        let errors = [summary.p50_mdeg, summary.p95_mdeg, summary.p999_mdeg, summary.max_mdeg];
        cells.extend(errors.map(millidegrees));
        cells.extend([summary.median_settle_s, summary.settle_over_bound].map(|value| format!("{value:.2}")));
        cells
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each row has its own tolerance and marks, and a finer one ends nearer to the target: of two moves at 0.5 and at
    /// 0.1 milli-degrees each within three of its tolerances.
    #[test]
    fn law_a_row_is_asked_for_its_own_tolerance() {
        let scene = BesideScene { name: "own".to_owned(), scene: Scene::default() };
        let found = ToleranceTrials::run(&[(scene, 2)]).unwrap();
        assert_eq!(found.0.len(), ASKED.len());
        for (row, (tolerance_deg, marks)) in found.0.iter().zip(ASKED) {
            assert_eq!((row.marks, row.scene.as_str()), (marks, "own"));
            let worst_mdeg = row.found.summary().max_mdeg;
            assert!(worst_mdeg < 3e3 * tolerance_deg, "{worst_mdeg} {tolerance_deg}");
        }
        let (name, table) = found.page_value();
        assert!(
            name == "table_tolerances" && table.contains("| own   | 8     | 0.10      | 2      |"),
            "{table}"
        );
    }
}
