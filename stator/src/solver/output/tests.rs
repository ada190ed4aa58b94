use proptest::prelude::*;

use super::*;

/// An output with two probes and two modes, as CalculiX lays it out.
const GOOD: &str = "
 displacements (vx,vy,vz) for set PROBES and time  0.1000000E+01

         5 -2.187979E-03  7.968184E-05  1.287062E-01
        16 -2.188890E-03  9.580829E-06  1.287298E-01

 total volume for set FOIL and time  0.1000000E+01

        8.338156E-01

 total volume for set SILICON and time  0.1000000E+01

        2.147691E+00

     E I G E N V A L U E   O U T P U T

 MODE NO    EIGENVALUE                       FREQUENCY
                                     REAL PART            IMAGINARY PART
                           (RAD/TIME)      (CYCLES/TIME     (RAD/TIME)

      1   0.2337965E+09   0.1529041E+05   0.2433544E+04   0.0000000E+00
      2   0.4735141E+09   0.2176038E+05   0.3463272E+04   0.0000000E+00

     P A R T I C I P A T I O N   F A C T O R S

      1  -0.5089263E-14   0.6724381E-14  -0.1061919E-03   0.2378136E-11   0.1725666E-11  -0.6759509E-07

                    E I G E N V A L U E    N U M B E R     1

 displacements (vx,vy,vz) for set PROBES and time  0.2000000E+01

         5  7.622533E+01  5.968075E+01  7.980511E+03
        16  7.613181E+01  5.956925E+01  8.157757E+03

                    E I G E N V A L U E    N U M B E R     2

 displacements (vx,vy,vz) for set PROBES and time  0.2000000E+01

        16  1.000000E+00  2.000000E+00  3.000000E+00
         5  4.000000E+00  5.000000E+00  6.000000E+00
";

const PROBES: [usize; 2] = [4, 15];

#[expect(clippy::float_cmp, reason = "the same digits, read twice")]
#[test]
fn exact_an_output_is_read() {
    let output = read(GOOD, &PROBES).unwrap();
    assert_eq!(output.cooled[1], [-2.188_890e-3, 9.580_829e-6, 0.128_729_8]);
    assert_eq!(output.volumes, [0.833_815_6, 2.147_691]);
    assert_eq!(output.modes.len(), 2);
    assert_eq!(output.modes[1].eigenvalue, 0.473_514_1e9);
    assert_eq!(output.modes[1].shape, [[4.0, 5.0, 6.0], [1.0, 2.0, 3.0]]);
}

/// One change of a good output for each thing that is checked.
#[test]
fn exact_wrong_outputs_are_refused() {
    for (from, to, why) in [
        ("7.968184E-05", "NaN", "line 4: no number"),
        ("7.968184E-05", "*******", "line 4: no number"),
        ("7.968184E-05", "1.0-102", "line 4: no number"),
        ("1.287062E-01", "", "line 4: fewer than three"),
        ("        16 -2", "        17 -2", "line 5: a node that was not asked for"),
        ("        16 -2", "         5 -2", "line 5: a node comes twice"),
        ("        16 -2.188890E-03  9.580829E-06  1.287298E-01\n", "", "displacements of a node are missing"),
        ("1.287298E-01", "1.287298E+04", "a displacement after cooling is absurd"),
        ("5.968075E+01", "5.968075E+09", "a shape is absurd"),
        ("2.147691E+00", "-2.147691E+00", "line 13: a volume"),
        ("total volume for set FOIL", "total volume for set GLUE", "no volumes"),
        ("      2   0.47", "      3   0.47", "line 22: a mode out of its turn"),
        ("      2   0.47", "      2   0.17", "line 22: eigenvalues that do not rise"),
        ("E I G E N V A L U E   O U T P U T", "", "not as many shapes as frequencies"),
        ("      2   0.4735141E+09   0.2176038E+05   0.3463272E+04   0.0000000E+00\n", "", "more shapes"),
        (
            " displacements (vx,vy,vz) for set PROBES and time  0.1",
            " nothing 0.1",
            "no displacements after cooling",
        ),
    ] {
        let changed = GOOD.replacen(from, to, 1);
        assert_ne!(changed, GOOD, "{from}");
        let said = read(&changed, &PROBES).unwrap_err().to_string();
        assert!(said.starts_with(why), "{from} to {to}: {said}");
    }
    assert!(read(GOOD, &[4, 4]).is_err());
    let twice =
        GOOD.replacen("     P A R T I", "     E I G E N V A L U E   O U T P U T\n 1 1.0\n\n P A R T I", 1);
    assert_eq!(read(&twice, &PROBES).unwrap_err().to_string(), "frequencies come twice");
}

proptest! {
    /// Whatever is written, in whole or in part, is refused or gives finite numbers of the right count: never a panic.
    #[test]
    fn law_no_output_breaks_the_reader(
        cut in 0..GOOD.len(),
        at in 0..GOOD.len(),
        junk in "[ \n0-9a-zA-Z.+*-]{0,40}",
    ) {
        let mut text = GOOD.to_owned();
        text.truncate(cut.max(at));
        text.replace_range(cut.min(at).., &junk);
        text.push_str(&GOOD[cut.min(at)..]);
        for text in [&text, &junk] {
            if let Ok(output) = read(text, &PROBES) {
                prop_assert_eq!(output.cooled.len(), 2);
                for mode in &output.modes {
                    prop_assert_eq!(mode.shape.len(), 2);
                    prop_assert!(mode.eigenvalue.is_finite());
                    prop_assert!(mode.shape.iter().flatten().all(|value| value.is_finite()));
                }
            }
        }
    }
}
