use std::time::Instant;

use super::*;

/// A program of a few lines in place of CalculiX.
#[cfg(unix)]
fn program(folder: &Path, script: &str) -> Solver {
    use std::os::unix::fs::PermissionsExt as _;
    let path = folder.join("program");
    fs::write(&path, format!("#!/bin/sh\n{script}\n")).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    Solver { program: path, limit: Duration::from_secs(60), cache: None }
}

#[expect(clippy::unnecessary_wraps, reason = "it stands for a reader that may refuse")]
fn any(text: &str) -> Result<String, OutputFault> {
    Ok(text.to_owned())
}

#[test]
fn exact_a_solver_that_is_not_there_is_named_with_what_installs_it() {
    let solver = Solver { program: PathBuf::from("/nowhere/ccx"), ..Solver::default() };
    let error = solver.solve("", any).unwrap_err();
    assert_eq!(error.to_string(), "cannot run /nowhere/ccx: no such program");
    assert!(error.hint().unwrap().contains("apt-get install calculix-ccx"));
}

#[cfg(unix)]
#[test]
fn law_a_solver_that_does_not_end_is_killed() {
    let folder = tempfile::tempdir().unwrap();
    let solver =
        Solver { limit: Duration::from_millis(200), ..program(folder.path(), "while :; do :; done") };
    let begun = Instant::now();
    let error = solver.solve("", any).unwrap_err();
    assert!(matches!(error, SolverError::TooSlow { .. }), "{error}");
    assert!(begun.elapsed() < Duration::from_secs(10));
}

#[cfg(unix)]
#[test]
fn exact_a_solver_that_fails_is_quoted() {
    let folder = tempfile::tempdir().unwrap();
    let solver = program(folder.path(), "echo ' *ERROR reading *NODE'; echo more; exit 201");
    let said = solver.solve("", any).unwrap_err().to_string();
    assert!(said.ends_with("failed, exit status: 201: *ERROR reading *NODE"), "{said}");
    // It may end in success all the same.
    let solver = program(folder.path(), "echo ' *ERROR in arpack'; echo > stator.dat");
    assert!(matches!(solver.solve("", any), Err(SolverError::Failed { .. })));
    let solver = program(folder.path(), "exit 0");
    assert!(matches!(solver.solve("", any), Err(SolverError::File { .. })));
}

#[cfg(unix)]
#[test]
fn law_a_solver_has_a_bound_of_memory_and_one_thread() {
    let folder = tempfile::tempdir().unwrap();
    let solver = program(folder.path(), "ulimit -v > stator.dat; echo $OMP_NUM_THREADS >> stator.dat");
    assert_eq!(solver.solve("", any).unwrap(), format!("{MEMORY_KB}\n1\n"));
}

/// A result is made once for each deck; one that is refused is not kept, and one that was damaged is made again.
#[cfg(unix)]
#[test]
fn law_results_are_kept_by_their_deck() {
    let folder = tempfile::tempdir().unwrap();
    let runs = folder.path().join("runs");
    let script = format!("cp stator.inp stator.dat; echo run >> {}", runs.display());
    let cache = folder.path().join("kept");
    let solver = Solver { cache: Some(cache.clone()), ..program(folder.path(), &script) };
    let count = || fs::read_to_string(&runs).unwrap_or_default().lines().count();
    let refuse = |_: &str| Err::<(), _>(OutputFault::Part("no"));
    assert!(matches!(solver.solve("one", refuse), Err(SolverError::BadOutput { .. })));
    assert_eq!(solver.solve("one", any).unwrap(), "one");
    assert_eq!(solver.solve("one", any).unwrap(), "one");
    assert_eq!(count(), 2);
    assert_eq!(solver.solve("two", any).unwrap(), "two");
    assert_eq!(count(), 3);
    for entry in fs::read_dir(&cache).unwrap() {
        fs::write(entry.unwrap().path(), "damaged").unwrap();
    }
    let whole = |text: &str| if text == "damaged" { Err(OutputFault::Part("no")) } else { Ok(()) };
    solver.solve("one", whole).unwrap();
    assert_eq!(count(), 4);
}
