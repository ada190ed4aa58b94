//! The filter that a board is asked for, and the next simpler one for a board that was built without it.

use link::{BoardFault, Configuration, ExperimentsConfiguration, FilterKind, HostMessage, RateConfiguration};

/// Key of the filter, as a board names it that was built without the one asked for.
const FILTER_KEY: &str = "estimator.filter";

/// Whether a board refuses a task for its filter.
pub(super) fn is_without(fault: &BoardFault) -> bool {
    matches!(fault, BoardFault::OutOfBounds { key } if key == FILTER_KEY)
}

/// The filter of a task; `None` of a message that is none.
pub(super) fn filter(task: &HostMessage) -> Option<FilterKind> {
    match task {
        HostMessage::Configure(Configuration { filter, .. })
        | HostMessage::ConfigureRate(RateConfiguration { filter, .. })
        | HostMessage::ConfigureExperiments(ExperimentsConfiguration { filter, .. }) => Some(*filter),
        _ => None,
    }
}

/// The same task with the next simpler filter; `None` after the simplest.
pub(super) fn with_simpler_filter(task: &HostMessage) -> Option<HostMessage> {
    let filter = match filter(task)? {
        FilterKind::Twin => FilterKind::ImpactAided,
        FilterKind::ImpactAided => FilterKind::ConstantRate,
        FilterKind::ConstantRate => return None,
    };
    with_filter(task, filter)
}

/// The same task with `filter`; `None` of a message that is none.
pub(super) fn with_filter(task: &HostMessage, filter: FilterKind) -> Option<HostMessage> {
    Some(match task.clone() {
        HostMessage::Configure(task) => HostMessage::Configure(Configuration { filter, ..task }),
        HostMessage::ConfigureRate(task) => HostMessage::ConfigureRate(RateConfiguration { filter, ..task }),
        HostMessage::ConfigureExperiments(task) => {
            HostMessage::ConfigureExperiments(ExperimentsConfiguration { filter, ..task })
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::super::task::BoardTask;
    use super::*;
    use crate::board::pil::filter_name;
    use simulation::scene::Scene;

    /// From the best to the simplest, and no further; the rest of a task stays, and what is no task has no filter.
    #[test]
    fn exact_the_next_simpler_filter_of_every_task() {
        let scene = Scene::default();
        for task in [BoardTask::Move, BoardTask::Rate, BoardTask::Commission] {
            let mut asked = task.preparation(&scene).unwrap().pop().unwrap();
            let begin = asked.clone();
            let mut names = Vec::new();
            loop {
                names.push(filter(&asked).map(filter_name).unwrap());
                match with_simpler_filter(&asked) {
                    Some(simpler) => asked = simpler,
                    None => break,
                }
            }
            assert_eq!(names, ["twin", "impact_aided", "constant_rate"], "{task:?}");
            let mut named = scene.clone();
            named.set("estimator.filter", "constant_rate").unwrap();
            assert_ne!(asked, begin);
            assert_eq!(task.preparation(&named).unwrap().pop(), Some(asked));
        }
        assert_eq!(with_simpler_filter(&HostMessage::Arm), None);
    }
}
