//! Line charts on logarithmic axes, as SVG.

use std::fmt::Write;

/// A named line.
pub type Series = (String, Vec<(f64, f64)>);

const COLOURS: [&str; 6] = ["#0b6e99", "#d9480f", "#2b8a3e", "#862e9c", "#5c5f66", "#e8a70c"];
const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 380.0;
const FRAME: [f64; 4] = [70.0, 470.0, 40.0, 330.0];

fn label(value: f64) -> String {
    if (1e-3..1e4).contains(&value) { format!("{value}") } else { format!("1e{}", value.log10().round()) }
}

/// The whole file. Points that are not positive are left out.
pub fn chart(title: &str, x_label: &str, y_label: &str, series: &[Series]) -> String {
    let points = || series.iter().flat_map(|(_, p)| p).filter(|p| p.0 > 0.0 && p.1 > 0.0);
    let range = |pick: fn(&(f64, f64)) -> f64| {
        let lo = points().map(pick).fold(f64::INFINITY, f64::min).log10();
        let hi = points().map(pick).fold(0.0, f64::max).log10();
        let margin = 0.04 * (hi - lo).max(0.5);
        [lo - margin, hi + margin]
    };
    let (xs, ys) = (range(|p| p.0), range(|p| p.1));
    let [left, right, top, bottom] = FRAME;
    let x = |value: f64| left + (value.log10() - xs[0]) / (xs[1] - xs[0]) * (right - left);
    let y = |value: f64| bottom - (value.log10() - ys[0]) / (ys[1] - ys[0]) * (bottom - top);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"#ffffff\"/>\n\
         <text x=\"{left}\" y=\"24\" font-size=\"15\">{title}</text>\n\
         <text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{x_label}</text>\n\
         <text transform=\"translate(16 {}) rotate(-90)\" text-anchor=\"middle\">{y_label}</text>\n",
        (left + right) / 2.0,
        HEIGHT - 12.0,
        (top + bottom) / 2.0
    );
    // Lines at powers of ten; at 2 and 5 too where there would be too few.
    let ticks = |[lo, hi]: [f64; 2]| {
        let steps: &[f64] = if hi - lo < 1.7 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let decades = lo.floor() as i32..=hi.ceil() as i32;
        let all = decades.flat_map(move |d| steps.iter().map(move |s| (s * 10f64.powi(d) * 1e9).round() / 1e9));
        all.filter(move |v| (lo..=hi).contains(&v.log10())).collect::<Vec<_>>()
    };
    for v in ticks(xs) {
        let at = x(v);
        let _ = writeln!(svg, "<line x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{top}\" y2=\"{bottom}\" stroke=\"#dddddd\"/>");
        let _ = writeln!(svg, "<text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>", bottom + 16.0, label(v));
    }
    for v in ticks(ys) {
        let at = y(v);
        let _ = writeln!(svg, "<line x1=\"{left}\" x2=\"{right}\" y1=\"{at:.1}\" y2=\"{at:.1}\" stroke=\"#dddddd\"/>");
        let _ =
            writeln!(svg, "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>", left - 6.0, at + 4.0, label(v));
    }
    for (i, (name, points)) in series.iter().enumerate() {
        let colour = COLOURS[i % COLOURS.len()];
        let visible: Vec<_> = points.iter().filter(|p| p.0 > 0.0 && p.1 > 0.0).map(|p| (x(p.0), y(p.1))).collect();
        let path: Vec<String> = visible.iter().map(|(a, b)| format!("{a:.1},{b:.1}")).collect();
        let _ = writeln!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>",
            path.join(" ")
        );
        for (a, b) in visible {
            let _ = writeln!(svg, "<circle cx=\"{a:.1}\" cy=\"{b:.1}\" r=\"3\" fill=\"{colour}\"/>");
        }
        let row = top + 14.0 + 20.0 * i as f64;
        let _ = writeln!(svg, "<text x=\"{}\" y=\"{row}\" fill=\"{colour}\">{name}</text>", right + 10.0);
    }
    svg + "</svg>\n"
}

#[cfg(test)]
mod tests {
    use super::chart;

    #[test]
    fn every_point_is_inside_the_frame() {
        let line = vec![(1e4, 30.0), (1e5, 50.0), (1e7, 900.0), (0.0, 1.0)];
        let svg = chart("t", "x", "y", &[("a".into(), line)]);
        let number = |text: &str, field: &str| -> f64 {
            let rest = &text[text.find(field).unwrap() + field.len()..];
            rest[..rest.find('"').unwrap()].parse().unwrap()
        };
        let circles: Vec<&str> = svg.lines().filter(|l| l.starts_with("<circle")).collect();
        assert_eq!(circles.len(), 3);
        for c in circles {
            assert!((70.0..=470.0).contains(&number(c, "cx=\"")) && (40.0..=330.0).contains(&number(c, "cy=\"")));
        }
        assert!(svg.contains(">1e4<") || svg.contains(">10000<"));
    }
}
