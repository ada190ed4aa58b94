//! The Python module as a user has it: a wheel, installed, and tested by pytest beside the command.

use std::path::Path;
use std::process::{Command, Output};

use crate::support::built_command::folder;
use crate::support::checkout::root;
use crate::support::python::python;

#[track_caller]
fn succeeds(command: &mut Command) -> Output {
    let output = command.output().expect("it starts");
    let [said, complaint] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    assert!(output.status.success(), "{command:?}\n{said}\n{complaint}");
    output
}

/// The module is the library that cargo has built for these tests, in their profile.
#[test]
fn tool_python_module_passes_its_tests() {
    let host_sim = Path::new(env!("CARGO_BIN_EXE_host-sim-under-test"));
    let library = host_sim.with_file_name("deps").join("lib_micromotor.so");
    let (folder, python) = (folder(), python());
    succeeds(
        Command::new(root().join("python/tests/pack_wheel.sh")).arg(library).arg(folder.path()).arg(python),
    );
    let wheels =
        std::fs::read_dir(folder.path()).expect("the folder").map(|file| file.expect("a file").path());
    let [wheel] = &wheels.collect::<Vec<_>>()[..] else { panic!("one wheel") };
    let install = ["-m", "pip", "--quiet", "install", "--no-deps", "--force-reinstall"];
    succeeds(Command::new(python).args(install).arg(wheel));
    let output = succeeds(
        Command::new(python)
            .args(["-m", "pytest", "--quiet", "--durations=8", "-p", "no:cacheprovider"])
            .arg("-c")
            .arg(root().join("python/pyproject.toml"))
            .arg(root().join("python/tests"))
            .env("MICROMOTOR_COMMAND", host_sim)
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .current_dir(folder.path()),
    );
    print!("{}", String::from_utf8_lossy(&output.stdout));
}
