//! Drawings as one PDF, a page each, at true scale.
//!
//! PDF counts points (1/72 inch) from the lower left corner; the page asks viewers not to scale it when they print.

use pdf_writer::{Content, Finish, Name, Pdf, Rect, Ref, Str};

use super::drawing::{Drawing, Mark, PointMm};

/// Points in a millimetre.
const POINTS_PER_MM: f64 = 72.0 / 25.4;
const CATALOG: Ref = Ref::new(1);
const PAGES: Ref = Ref::new(2);
const FONT: Ref = Ref::new(3);
const FONT_NAME: Name<'static> = Name(b"F1");
/// Numbers of objects from here on: a page and its content in turn.
const FIRST_PAGE: i32 = 4;

/// The PDF file's bytes.
pub fn to_pdf(drawings: &[Drawing]) -> Vec<u8> {
    let mut pdf = Pdf::new();
    let page_refs: Vec<(Ref, Ref)> = (FIRST_PAGE..)
        .step_by(2)
        .take(drawings.len())
        .map(|number| (Ref::new(number), Ref::new(number + 1)))
        .collect();
    let mut catalog = pdf.catalog(CATALOG);
    catalog.pages(PAGES);
    catalog.viewer_preferences().pair(Name(b"PrintScaling"), Name(b"None"));
    catalog.finish();
    let count = i32::try_from(drawings.len()).unwrap_or(i32::MAX);
    pdf.pages(PAGES).kids(page_refs.iter().map(|(page, _)| *page)).count(count);
    // One of the fonts that every viewer has: nothing needs to be embedded.
    pdf.type1_font(FONT).base_font(Name(b"Helvetica"));
    for (drawing, (page_ref, content_ref)) in drawings.iter().zip(page_refs) {
        let mut page = pdf.page(page_ref);
        page.media_box(Rect::new(0.0, 0.0, points(drawing.size_mm[0]), points(drawing.size_mm[1])));
        page.parent(PAGES).contents(content_ref);
        page.resources().fonts().pair(FONT_NAME, FONT);
        page.finish();
        pdf.stream(content_ref, &content(drawing).finish());
    }
    pdf.finish()
}

fn content(drawing: &Drawing) -> Content {
    let mut content = Content::new();
    let place = |[x, y]: PointMm| (points(x), points(drawing.size_mm[1] - y));
    for mark in &drawing.marks {
        match mark {
            Mark::Fill { outlines, grey } => {
                content.set_fill_gray(*grey as f32);
                for outline in outlines {
                    trace(&mut content, outline, &place);
                    content.close_path();
                }
                content.fill_nonzero();
            }
            Mark::Line { points: line, kind } => {
                content.set_stroke_gray(kind.grey() as f32).set_line_width(points(kind.width_mm()));
                content.set_dash_pattern(kind.dash_mm().map(points), 0.0);
                trace(&mut content, line, &place);
                content.stroke();
            }
            Mark::Text { at_mm, height_mm, text } => {
                let (x, y) = place(*at_mm);
                content.set_fill_gray(0.0);
                content.begin_text().set_font(FONT_NAME, points(*height_mm)).next_line(x, y);
                content.show(Str(text.as_bytes())).end_text();
            }
        }
    }
    content
}

fn trace(content: &mut Content, line: &[PointMm], place: &impl Fn(PointMm) -> (f32, f32)) {
    for (k, point) in line.iter().enumerate() {
        let (x, y) = place(*point);
        if k == 0 {
            content.move_to(x, y);
        } else {
            content.line_to(x, y);
        }
    }
}

fn points(mm: f64) -> f32 {
    (mm * POINTS_PER_MM) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::print::drawing::LineKind;

    #[test]
    fn a_page_has_its_size_and_is_not_scaled_by_the_viewer() {
        let mut page = Drawing::new([254.0, 127.0]);
        page.line([25.4, 25.4], [127.0, 25.4], LineKind::Scale);
        let sut = to_pdf(&[page.clone(), page]);
        let text = String::from_utf8_lossy(&sut);
        for expected in ["/MediaBox [0 0 720 360]", "/PrintScaling /None", "/Count 2", "72 288 m\n360 288 l"]
        {
            assert!(text.contains(expected), "{expected} in {text}");
        }
    }
}
