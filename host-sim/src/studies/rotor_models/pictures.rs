//! The comparison as pictures.

use motor_model::DriveMode;

use super::draws::{CLEARANCE, DAMPING_OF_C, DRAWN, DrawnRotor, stators};
use super::measured::{QUANTITIES, experiment, spread};
use super::predictions::PREDICTIONS;
use super::variants::EXPLAINING;
use super::{MODES, RotorModels, VARIANTS};
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use simulation::math::count::real;

const fn colour(mode: DriveMode) -> Colour {
    match mode {
        DriveMode::B => Colour::Vermilion,
        DriveMode::C => Colour::Blue,
    }
}

impl RotorModels {
    /// Every picture, with the name of its file.
    pub fn pictures(&self) -> Vec<(String, Figure)> {
        let mut pictures = vec![
            ("rotors.svg".to_owned(), self.rotors()),
            ("mode_b_predictions.svg".to_owned(), self.predicted()),
        ];
        if !self.drawn.is_empty() {
            pictures.push(("drawn_rotors.svg".to_owned(), self.drawn_rotors()));
            pictures.push(("drawn_rates.svg".to_owned(), self.drawn_rates()));
            pictures.push(("drawn_stators.svg".to_owned(), self.drawn_stators()));
        }
        pictures
    }

    /// Each figure of the experiment, and what each rotor shows of it.
    fn rotors(&self) -> Figure {
        let mut figure = Figure::new(format!("The experiment and {} rotors", self.variants.len())).caption(format!(
            "Means and standard deviations of {} runs. Grey: the experiment; its rates are printed without a \
             standard deviation.",
            self.seeds
        ));
        for (index, mode) in MODES.into_iter().enumerate() {
            for quantity in QUANTITIES {
                let last = real(self.variants.len()) + 0.5;
                let (mean, sd) = experiment(mode, quantity);
                let bars = self.variants.iter().enumerate().map(|(place, variant)| {
                    let spread = spread(&variant.runs[index], |run| run.get(quantity));
                    (real(place + 1), spread.mean, spread.sd)
                });
                let bars: Vec<(f64, f64, f64)> = bars.collect();
                let top = bars.iter().map(|bar| bar.1 + bar.2).fold(mean + sd.unwrap_or(0.0), f64::max);
                let names = self.variants.iter().map(|variant| variant.name.to_owned()).collect();
                let title = format!("Mode {mode:?}: {quantity}");
                let words = quantity.to_string();
                let unit = format!("{} ({})", words.rsplit(' ').next().unwrap_or(&words), quantity.unit());
                let band = sd.unwrap_or(0.02 * top);
                figure = figure.panel(
                    Panel::new(title, Axis::of_names("", names), Axis::new(unit).within(0.0..1.1 * top))
                        .height(210)
                        .series(
                            Series::band(vec![
                                (0.5, mean - band, mean + band),
                                (last, mean - band, mean + band),
                            ])
                            .colour(Colour::Grey)
                            .opacity(0.45)
                            .label("experiment"),
                        )
                        .series(Series::error_bars(bars).colour(colour(mode)).width(1.8)),
                );
            }
        }
        figure
    }

    /// The rate of mode B against what a builder can change.
    fn predicted(&self) -> Figure {
        let mut figure = Figure::new("What would test it: the rate of mode B").caption(
            "A rotor that can only rise and fall has no hub, and turns faster the stronger the drive.",
        );
        for varied in &PREDICTIONS {
            let (label, per_unit) = varied.axis;
            let mut panel = Panel::new(varied.title, Axis::new(label), Axis::new("rate (rad/s)")).height(230);
            for (rotor, colour) in
                EXPLAINING.map(|index| VARIANTS[index].name).into_iter().zip([Colour::Purple, Colour::Green])
            {
                let of = self.predictions.iter().filter(|of| of.rotor == rotor && of.key == varied.key);
                let bars: Vec<(f64, f64, f64)> = of
                    .flat_map(|of| &of.points)
                    .map(|(value, runs)| {
                        let rate = spread(runs, |run| run.rate_rad_s);
                        (per_unit * value, rate.mean, rate.sd)
                    })
                    .collect();
                panel = panel
                    .series(
                        Series::line(bars.iter().map(|bar| (bar.0, bar.1)).collect())
                            .colour(colour)
                            .opacity(0.5),
                    )
                    .series(Series::error_bars(bars).colour(colour).label(rotor));
            }
            figure = figure.panel(panel);
        }
        figure
    }

    /// The rates of the drawn rotors in both modes, by how many of the six figures agree.
    fn drawn_rates(&self) -> Figure {
        let rates = |met: std::ops::RangeInclusive<usize>| -> Vec<(f64, f64)> {
            let of = |rotor: &&DrawnRotor| met.contains(&rotor.figures_met());
            let pair = |rotor: &DrawnRotor| (rotor.runs[0].rate_rad_s, rotor.runs[1].rate_rad_s);
            self.drawn.iter().filter(of).map(pair).collect()
        };
        let [(b, _), (c, _)] = MODES.map(|mode| experiment(mode, QUANTITIES[0]));
        let panel = Panel::new(
            "Rate of mode C against that of mode B",
            Axis::new("rate in mode B (rad/s)"),
            Axis::new("rate in mode C (rad/s)"),
        )
        .height(360)
        .series(
            Series::band(vec![(0.5 * b, 0.85 * c, 1.15 * c), (2.0 * b, 0.85 * c, 1.15 * c)])
                .colour(Colour::Grey)
                .opacity(0.5)
                .label("experiment"),
        )
        .series(Series::points(rates(0..=3)).colour(Colour::Sky).label("three figures or fewer agree"))
        .series(Series::points(rates(4..=4)).colour(Colour::Blue).label("four"))
        .series(Series::points(rates(5..=5)).colour(Colour::Purple).label("five"))
        .series(Series::points(rates(6..=6)).colour(Colour::Vermilion).width(2.5).label("six"));
        Figure::new(format!("Which of {} drawn rotors agree with the experiment", self.drawn.len()))
            .caption(
                "The stator's values within what finite elements leave open. Grey: where both rates agree.",
            )
            .panel(panel)
    }

    /// Which stators agree: each drawn rotor above the stator that it was drawn over.
    fn drawn_stators(&self) -> Figure {
        let (all, flat) = stators();
        let of = |panel: Panel, value: &dyn Fn(&DrawnRotor) -> f64| {
            let points = |is_flat: bool| -> Vec<(f64, f64)> {
                let of_kind = self.drawn.iter().filter(|rotor| (rotor.stator < flat) == is_flat);
                of_kind.map(|rotor| (real(rotor.stator + 1), value(rotor))).collect()
            };
            panel.series(Series::points(points(true)).colour(Colour::Blue).opacity(0.6).label("flat")).series(
                Series::points(points(false)).colour(Colour::Vermilion).opacity(0.6).label("stressed"),
            )
        };
        let axis = || Axis::new("stator (1)").within(0.0..real(all) + 1.0);
        let figures = Axis::new("figures of six (1)").within(-0.5..6.5);
        let mut figure = Figure::new("Which stators of finite elements agree with the experiment")
            .caption(
                "Each dot is a drawn rotor, above the stator it was drawn over. Grey: where the rate agrees.",
            )
            .panel(of(Panel::new("Figures in which it agrees", axis(), figures).height(250), &|rotor| {
                real(rotor.figures_met())
            }));
        for (index, mode) in MODES.into_iter().enumerate() {
            let (rate, _) = experiment(mode, QUANTITIES[0]);
            let (low, high) = if index == 0 { (0.5 * rate, 2.0 * rate) } else { (0.85 * rate, 1.15 * rate) };
            let panel = Panel::new(format!("Rate of mode {mode:?}"), axis(), Axis::new("rate (rad/s)"))
                .height(250)
                .series(
                    Series::band(vec![(0.0, low, high), (real(all) + 1.0, low, high)])
                        .colour(Colour::Grey)
                        .opacity(0.5)
                        .label("experiment"),
                );
            figure = figure.panel(of(panel, &|rotor| rotor.runs[index].rate_rad_s));
        }
        figure
    }

    /// Which drawn value decides the rate of each mode.
    fn drawn_rotors(&self) -> Figure {
        let mut figure = Figure::new(format!("{} rotors drawn over what is not known", self.drawn.len()))
            .caption("Rank correlation of a value with the rate; beyond the grey band it is not chance.");
        let (last, chance) = (real(DRAWN.len()) + 0.5, self.significant());
        for (index, mode) in MODES.into_iter().enumerate() {
            let points = (0..DRAWN.len()).map(|key| (real(key + 1), self.correlation(key, index)));
            let names = DRAWN.iter().map(|drawn| drawn.name.to_owned()).collect();
            figure = figure.panel(
                Panel::new(
                    format!("What decides the rate of mode {mode:?}"),
                    Axis::of_names("", names),
                    Axis::new("rank correlation (1)").within(-1.0..1.0),
                )
                .height(300)
                .series(
                    Series::band(vec![(0.5, -chance, chance), (last, -chance, chance)])
                        .colour(Colour::Grey)
                        .opacity(0.4)
                        .label("chance"),
                )
                .series(Series::points(points.collect()).colour(colour(mode)).width(2.5)),
            );
        }
        let deciding =
            [(CLEARANCE, "clearance (um)", 1e6), (DAMPING_OF_C, "damping ratio of mode C (1)", 1.0)];
        for (index, (mode, (key, label, per_unit))) in MODES.into_iter().zip(deciding).enumerate() {
            let of = |agrees: bool| -> Vec<(f64, f64)> {
                let rotors = self
                    .drawn
                    .iter()
                    .filter(|rotor| rotor.agreements()[index].iter().all(|figure| *figure) == agrees);
                rotors.map(|rotor| (per_unit * rotor.values[key], rotor.runs[index].rate_rad_s)).collect()
            };
            figure = figure.panel(
                Panel::new(
                    format!("Rate of mode {mode:?} against {}", DRAWN[key].name),
                    Axis::new(label),
                    Axis::new("rate (rad/s)"),
                )
                .height(280)
                .series(Series::points(of(false)).colour(Colour::Grey).label("disagrees"))
                .series(Series::points(of(true)).colour(colour(mode)).label("agrees in all three figures")),
            );
        }
        figure
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studies::paper::runs::RunTime;
    use crate::studies::rotor_models::VariantRuns;
    use crate::studies::rotor_models::measured::MeasuredRun;

    fn run(rate_rad_s: f64, line_hz: f64, amplitude_mm_s: f64) -> MeasuredRun {
        MeasuredRun {
            rate_rad_s,
            collision_frequency_hz: line_hz,
            collision_amplitude_mm_s: amplitude_mm_s,
            rim_amplitude_mm_s: 2.0 * amplitude_mm_s,
            tilt_rms_mrad: 20.0,
            hub_contacts_per_s: 500.0,
            reversed_share: 0.0,
        }
    }

    /// A rotor that meets the experiment in mode B, and in mode C all figures or none.
    fn drawn(mode_c: MeasuredRun) -> DrawnRotor {
        let values = DRAWN.iter().map(|drawn| drawn.range().0).collect();
        DrawnRotor { stator: 0, values, runs: [run(1.0, 76.0, 3.94), mode_c] }
    }

    /// Every picture can be drawn: no two things of a panel have one colour, and each axis has a unit. The drawn rotors
    /// stand by the number of figures in which they agree.
    #[test]
    fn tool_every_picture_is_drawn() {
        let (meets, fails) = (drawn(run(1.4, 400.0, 0.88)), drawn(run(3.3, 100.0, 3.0)));
        assert_eq!([meets.figures_met(), fails.figures_met()], [6, 3]);
        let runs = || [vec![run(1.0, 76.0, 3.9); 2], vec![run(1.4, 400.0, 0.9); 2]];
        let models = RotorModels {
            seeds: 2,
            time: RunTime::FULL,
            change_seeds: 2,
            variants: VARIANTS.iter().map(|of| VariantRuns { name: of.name, runs: runs() }).collect(),
            predictions: Vec::new(),
            changed: Vec::new(),
            drawn: vec![meets, fails],
        };
        let pictures = models.pictures();
        assert_eq!(pictures.len(), 5);
        for (name, figure) in &pictures {
            assert!(figure.svg().unwrap().contains("<svg"), "{name}");
        }
    }
}
