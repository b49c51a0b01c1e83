//! Plots of error against the angle of incidence, as SVG.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::prelude::*;

use super::numerics::bound;
use crate::numerics::suite::{ANGLES, RegionReport};

/// What one plot shows of a function: measures that share an axis.
struct Panel {
    function: &'static str,
    title: &'static str,
    axis: &'static str,
    /// Measures by their names in the table of bounds, with what the legend calls them.
    curves: &'static [(&'static str, &'static str)],
}

static PANELS: [Panel; 10] = [
    Panel {
        function: "fresnel",
        title: "fresnel: reflectance",
        axis: "worst absolute error",
        curves: &[
            ("reflectance, absolute", "vitrum"),
            ("reflectance, absolute, textbook", "textbook formula in 32 bits"),
        ],
    },
    Panel {
        function: "fresnel",
        title: "fresnel: transmitted cosine",
        axis: "worst error, ULP",
        curves: &[("cos_t, ULP", "vitrum"), ("cos_t, ULP, textbook", "textbook formula in 32 bits")],
    },
    Panel {
        function: "fresnel",
        title: "fresnel: reflectance, in units of its last place",
        axis: "worst error, ULP",
        curves: &[("reflectance, ULP", "vitrum")],
    },
    Panel {
        function: "fresnel_transmittance",
        title: "fresnel_transmittance",
        axis: "worst error, ULP",
        curves: &[("transmittance, ULP", "vitrum")],
    },
    Panel {
        function: "refract",
        title: "refract: direction",
        axis: "worst absolute error",
        curves: &[("wt_x, absolute", "wt_x"), ("wt_y, absolute", "wt_y"), ("wt_z, absolute", "wt_z")],
    },
    Panel {
        function: "original_fresnel",
        title: "original_fresnel: reflectance, from in front",
        axis: "worst error, ULP",
        curves: &[("reflectance, ULP", "vitrum")],
    },
    Panel {
        function: "rough_eval",
        title: "rough_eval",
        axis: "worst relative error",
        curves: &[("value, relative", "value"), ("pdf, relative", "pdf")],
    },
    Panel {
        function: "rough_sample",
        title: "rough_sample: direction and weight, times 1 - u2",
        axis: "worst error",
        curves: &[("wo, absolute, times 1 - u2", "wo"), ("weight over radiance's scale, times 1 - u2", "weight")],
    },
    Panel {
        function: "rough_sample",
        title: "rough_sample: density and value at the direction",
        axis: "worst relative error",
        curves: &[
            ("pdf against the reference at wo, relative", "pdf"),
            ("weight times pdf against value, relative", "weight times pdf"),
        ],
    },
    Panel {
        function: "visible_normal",
        title: "visible_normal: slope, times 1 - u2",
        axis: "worst error over alpha or slope",
        curves: &[("slope over alpha or itself, times 1 - u2", "slope")],
    },
];

/// Pixels of a panel.
const PANEL: (u32, u32) = (640, 400);
const COLUMNS: usize = 2;
/// The palette of Okabe and Ito (2008), which colour-blind readers can tell apart.
pub(super) const COLORS: [RGBColor; 4] =
    [RGBColor(0, 114, 178), RGBColor(213, 94, 0), RGBColor(0, 158, 115), RGBColor(204, 121, 167)];
pub(super) const INK: RGBColor = RGBColor(40, 40, 40);
pub(super) const GRID: RGBColor = RGBColor(225, 225, 225);
/// A plot shows no more powers of ten than this.
const MOST_DECADES: f64 = 14.0;
/// Pixels left of a plot.
const LEFT: i32 = 86;

pub(super) type Drawn<'a> = Result<(), DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// The worst errors of a measure over all regions, by degrees of incidence.
struct Curve {
    label: &'static str,
    worst: Vec<f64>,
    /// Infinite: for comparison only.
    bound: f64,
}

/// All panels of which there is something to show, in one SVG; `None` if there are none.
pub(super) fn svg(regions: &[RegionReport]) -> std::io::Result<Option<String>> {
    let panels: Vec<_> =
        PANELS.iter().map(|panel| (panel, curves(panel, regions))).filter(|(_, curves)| !curves.is_empty()).collect();
    if panels.is_empty() {
        return Ok(None);
    }
    let (rows, columns) = (panels.len().div_ceil(COLUMNS), panels.len().min(COLUMNS));
    let mut text = String::new();
    let draw = |text| -> Drawn {
        let size = (columns as u32 * PANEL.0, rows as u32 * PANEL.1);
        let root = SVGBackend::with_string(text, size).into_drawing_area();
        root.fill(&WHITE)?;
        for (area, (panel, curves)) in root.split_evenly((rows, columns)).iter().zip(&panels) {
            draw_panel(area, panel, curves)?;
        }
        root.present()
    };
    draw(&mut text).map_err(std::io::Error::other)?;
    Ok(Some(text))
}

fn curves(panel: &Panel, regions: &[RegionReport]) -> Vec<Curve> {
    let findings = || regions.iter().flat_map(|region| &region.findings).filter(|f| f.function == panel.function);
    let curve = |&(measure, label): &(&'static str, &'static str)| {
        let mut curve = Curve { label, worst: vec![0.0; ANGLES], bound: 0.0 };
        let mut any = false;
        for finding in findings().filter(|finding| finding.measure == measure) {
            for (worst, &error) in curve.worst.iter_mut().zip(finding.by_angle.as_ref()?) {
                *worst = worst.max(error);
            }
            curve.bound = curve.bound.max(finding.bound);
            any = true;
        }
        any.then_some(curve)
    };
    panel.curves.iter().filter_map(curve).collect()
}

/// The axis of errors: logarithmic, or from 0 where all are of one size.
struct Scale {
    is_linear: bool,
    /// In the plot; logarithms, or what is shown itself.
    low: f64,
    high: f64,
}

impl Scale {
    fn of(curves: &[Curve]) -> Self {
        let values = || {
            let all = curves.iter().flat_map(|curve| curve.worst.iter().chain([&curve.bound]));
            all.copied().filter(|value| *value > 0.0 && value.is_finite())
        };
        let (least, most) = (values().fold(f64::INFINITY, f64::min), values().fold(0.0, f64::max));
        if most == 0.0 {
            Self { is_linear: true, low: 0.0, high: 1.0 }
        } else if least > most / 30.0 {
            // A line along the frame would not show.
            Self { is_linear: true, low: 0.0, high: 1.15 * most }
        } else {
            let high = (most.log10() + 0.2).ceil();
            Self { is_linear: false, low: least.log10().floor().max(high - MOST_DECADES), high }
        }
    }

    fn place(&self, value: f64) -> f64 {
        (if self.is_linear { value } else { value.log10() }).clamp(self.low, self.high)
    }

    /// At most eight or so.
    fn ticks(&self) -> Vec<f64> {
        let step = if self.is_linear {
            let power = 10_f64.powf(self.high.log10().floor());
            [0.1, 0.2, 0.5, 1.0, 2.0].map(|x| x * power).into_iter().find(|x| self.high / x <= 8.0).unwrap_or(power)
        } else {
            ((self.high - self.low) / 8.0).floor() + 1.0
        };
        let (first, last) = ((self.low / step).ceil() as i32, (self.high / step).floor() as i32);
        (first..=last).map(|i| f64::from(i) * step).collect()
    }

    fn label(&self, place: f64) -> String {
        if self.is_linear { bound(place) } else { power_of_ten(place.round() as i32) }
    }
}

fn draw_panel<'a>(area: &Area<'a>, panel: &Panel, curves: &[Curve]) -> Drawn<'a> {
    let scale = Scale::of(curves);
    let least = 10_f64.powf(scale.low);
    let is_cut = !scale.is_linear && curves.iter().any(|curve| curve.worst.iter().any(|&error| error < least));
    let axis = match is_cut {
        true => format!("{} (0 and below {}: drawn there)", panel.axis, scale.label(scale.low)),
        false => panel.axis.to_owned(),
    };

    let bold = ("sans-serif", 19).into_font().style(FontStyle::Bold).color(&INK);
    area.draw(&Text::new(panel.title, (LEFT, 14), bold))?;
    let mut chart = ChartBuilder::on(area)
        .margin_top(68)
        .margin_right(28)
        .margin_bottom(10)
        .margin_left(14)
        .x_label_area_size(48)
        .y_label_area_size(LEFT as u32 - 14)
        .build_cartesian_2d(
            Axis { from: 0.0, to: ANGLES as f64, ticks: (0..=ANGLES).step_by(15).map(|x| x as f64).collect() },
            Axis { from: scale.low, to: scale.high, ticks: scale.ticks() },
        )?;
    let small = ("sans-serif", 15).into_font().color(&INK);
    chart
        .configure_mesh()
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .axis_style(INK)
        .label_style(small.clone())
        .axis_desc_style(small.clone())
        .x_desc("angle of incidence, degrees")
        .y_desc(axis)
        .x_label_formatter(&|degrees| format!("{degrees:.0}"))
        .y_label_formatter(&|place| scale.label(*place))
        .draw()?;

    let bounds: Vec<_> = curves.iter().map(|curve| curve.bound).filter(|bound| bound.is_finite()).collect();
    let shared = bounds.first().filter(|first| bounds.iter().all(|bound| bound == *first));
    let dashes = |bound: f64, color: RGBColor| {
        let ends = [0.0, ANGLES as f64].map(|x| (x, scale.place(bound)));
        DashedLineSeries::new(ends, 6, 4, color.stroke_width(1))
    };
    let mut x = LEFT;
    let mut legend = |style: ShapeStyle, dashed: bool, text: String| -> Drawn<'a> {
        let (y, length) = (50, 26);
        let dashes: &[_] = if dashed { &[(0, 6), (10, 16), (20, 26)] } else { &[(0, length)] };
        for (from, to) in dashes {
            area.draw(&PathElement::new([(x + from, y), (x + to, y)], style))?;
        }
        area.draw(&Text::new(text.clone(), (x + length + 6, y - 6), small.clone()))?;
        // Glyphs of common fonts are narrower.
        x += length + 26 + 7 * text.chars().count() as i32;
        Ok(())
    };
    for (i, (curve, color)) in curves.iter().zip(COLORS).enumerate() {
        // Curves that lie on each other both show.
        let style = color.stroke_width(if i == 0 && curves.len() > 1 { 4 } else { 2 });
        let has_bound = curve.bound.is_finite();
        let limit =
            if shared.is_none() && has_bound { format!(", bound {}", bound(curve.bound)) } else { String::new() };
        legend(style, /* dashed: */ false, format!("{}{limit}", curve.label))?;
        if shared.is_none() && has_bound {
            chart.draw_series(dashes(curve.bound, color))?;
        }
        let points = (0..).zip(&curve.worst).map(|(degree, &error)| (f64::from(degree) + 0.5, scale.place(error)));
        chart.draw_series(LineSeries::new(points, style))?;
    }
    if let Some(&shared) = shared {
        legend(INK.stroke_width(1), /* dashed: */ true, format!("bound {}", bound(shared)))?;
        chart.draw_series(dashes(shared, INK))?;
    }
    Ok(())
}

/// An axis with ticks where they are wanted.
pub(super) struct Axis {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) ticks: Vec<f64>,
}

impl Ranged for Axis {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (first, last): (i32, i32)) -> i32 {
        first + (f64::from(last - first) * (value - self.from) / (self.to - self.from)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> Range<f64> {
        self.from..self.to
    }
}

pub(super) fn power_of_ten(power: i32) -> String {
    let raised = |digit| match digit {
        '-' => '\u{207b}',
        '1' => '\u{b9}',
        '2' => '\u{b2}',
        '3' => '\u{b3}',
        digit => char::from_u32(0x2070 + digit.to_digit(10).unwrap_or_default()).unwrap_or(digit),
    };
    if power == 0 { "1".into() } else { format!("10{}", power.to_string().chars().map(raised).collect::<String>()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::{Function, REGIONS};

    #[test]
    fn panels_show_measures_that_there_are() {
        for panel in &PANELS {
            let function = Function::named(panel.function).expect("a function");
            assert!(panel.curves.len() <= COLORS.len());
            for (measure, _) in panel.curves {
                let regions = REGIONS.iter().filter(|region| region.function == panel.function);
                let mut measures = regions.flat_map(|region| region.bounds);
                assert!(measures.any(|(known, _)| known.name(function) == *measure), "{}: {measure}", panel.title);
            }
        }
    }

    fn scale(worst: f64, bound: f64) -> Scale {
        Scale::of(&[Curve { label: "", worst: vec![worst; ANGLES], bound }])
    }

    #[test]
    fn powers_are_raised_and_ticks_few() {
        assert_eq!([-12, 0, 3].map(power_of_ten), ["10\u{207b}\u{b9}\u{b2}", "1", "10\u{b3}"]);
        assert_eq!(scale(1e-9, 0.9).ticks(), [-8.0, -6.0, -4.0, -2.0, 0.0]);
        assert_eq!(scale(3.0, 4.0).ticks(), [0.0, 1.0, 2.0, 3.0, 4.0]);
        assert_eq!(scale(13.0, 16.0).ticks(), [0.0, 5.0, 10.0, 15.0]);
        assert_eq!(scale(0.0, f64::INFINITY).place(f64::INFINITY), 1.0);
    }
}
