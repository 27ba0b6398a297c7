//! A drawing as SVG, in millimetres: one unit of the picture is one millimetre on paper.

use std::fmt::Write;

use super::drawing::{Drawing, Mark, PointMm};

/// The SVG file's text.
pub fn to_svg(drawing: &Drawing) -> String {
    let [width, height] = drawing.size_mm;
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" viewBox=\"0 0 {width} \
         {height}\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n"
    );
    for mark in &drawing.marks {
        write_mark(&mut text, mark);
    }
    text.push_str("</svg>\n");
    text
}

fn write_mark(text: &mut String, mark: &Mark) {
    let _ = match mark {
        Mark::Fill { outlines, grey } => {
            let data: Vec<String> =
                outlines.iter().map(|outline| format!("{}Z", path_data(outline))).collect();
            writeln!(text, "<path fill=\"{}\" d=\"{}\"/>", colour(*grey), data.concat())
        }
        Mark::Line { points, kind } => {
            let dash = kind.dash_mm().map(|dash| format!(" stroke-dasharray=\"{dash}\"")).unwrap_or_default();
            writeln!(
                text,
                "<path fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"{dash} d=\"{}\"/>",
                colour(kind.grey()),
                kind.width_mm(),
                path_data(points)
            )
        }
        Mark::Text { at_mm: [x, y], height_mm, text: words } => writeln!(
            text,
            "<text x=\"{}\" y=\"{}\" font-family=\"Helvetica, Arial, sans-serif\" \
             font-size=\"{height_mm}\">{}</text>",
            Number(*x),
            Number(*y),
            words.replace('&', "&amp;").replace('<', "&lt;")
        ),
    };
}

fn path_data(points: &[PointMm]) -> String {
    let mut data = String::new();
    for (k, [x, y]) in points.iter().enumerate() {
        let _ = write!(data, "{}{} {}", if k == 0 { 'M' } else { 'L' }, Number(*x), Number(*y));
    }
    data
}

fn colour(grey: f64) -> String {
    let level = (grey.clamp(0.0, 1.0) * 255.0).round() as u8;
    format!("#{level:02x}{level:02x}{level:02x}")
}

/// Rounded to a tenth of a micrometre, without trailing zeros.
struct Number(f64);

impl std::fmt::Display for Number {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // Adding 0 loses the sign of a negative zero.
        write!(formatter, "{}", (self.0 * 1e4).round() / 1e4 + 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::print::drawing::LineKind;

    #[test]
    fn one_unit_is_one_millimetre() {
        let mut page = Drawing::new([210.0, 297.0]);
        page.line([10.0, 20.0], [110.0, 20.0], LineKind::Scale);
        let sut = to_svg(&page);
        assert!(sut.contains("width=\"210mm\" height=\"297mm\" viewBox=\"0 0 210 297\""), "{sut}");
        assert!(sut.contains("d=\"M10 20L110 20\""), "{sut}");
    }
}
