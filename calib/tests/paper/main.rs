//! Printed pages, judged on paper: the SVG and PDF files themselves are rasterised at 300 dpi, and the upstream
//! library looks for the tags.

#![expect(clippy::expect_used, reason = "helpers of tests: a panic there is the report")]

mod raster;

use std::path::Path;

use locoman_calib::print::drawing::Page;
use locoman_calib::print::spec::Spec;
use locoman_calib::print::{boards, net, pdf, sheets, svg};
use locoman_vision::detect::{Detector, Search};
use locoman_vision::image::GrayImage;
use locoman_vision::shells::design;

use raster::{Ink, rasterise};

const DPI: f64 = 300.0;
const MM_PER_PX: f64 = 25.4 / DPI;
/// The issue's own number.
const MOST_ERROR_MM: f64 = 0.1;

fn spec() -> Spec {
    Spec::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/calib/print.toml")).expect("valid")
}

fn svg_image(page: &Page) -> GrayImage {
    rasterise(&Ink::of_svg(&svg::to_svg(&page.drawing)), DPI)
}

fn pdf_image(page: &Page) -> GrayImage {
    rasterise(&Ink::of_pdf(&pdf::to_pdf(std::slice::from_ref(&page.drawing))), DPI)
}

/// All tags are found, no other, each corner within a tenth of a millimetre.
fn judge(page: &Page, image: &GrayImage) {
    let ids: Vec<u32> = (0..587).collect();
    let mut detector = Detector::new(&ids).expect("a detector");
    let found = detector.detect(image, Search::Full { decimate: 2.0 });
    let mut expected: Vec<u32> = page.tags.iter().map(|tag| tag.id).collect();
    expected.sort_unstable();
    assert_eq!(found.iter().map(|tag| tag.id).collect::<Vec<_>>(), expected);
    for tag in &page.tags {
        let seen = found.iter().find(|seen| seen.id == tag.id).expect("found");
        for (corner, nominal_mm) in seen.corners_px.iter().zip(tag.square(tag.side_mm)) {
            // Pixel centres at integers: the page's corner is at -0.5.
            let error_mm = [0, 1].map(|k| (corner[k] + 0.5) * MM_PER_PX - nominal_mm[k]);
            assert!(error_mm[0].hypot(error_mm[1]) < MOST_ERROR_MM, "tag {}: {error_mm:?} mm", tag.id);
        }
        has_a_white_cell_all_round(tag.id, image, |x, y| tag.page_from_tag(x, y), tag.side_mm);
    }
}

/// Samples the ring of one cell round the black square.
fn has_a_white_cell_all_round(
    id: u32,
    image: &GrayImage,
    page_from_tag: impl Fn(f64, f64) -> [f64; 2],
    side_mm: f64,
) {
    /// Lighter than any line or letter.
    const WHITE: u8 = 250;
    let cell_mm = side_mm / 8.0;
    for lane in [0.1, 0.5, 0.9] {
        let reach = side_mm / 2.0 + lane * cell_mm;
        for step in -50..=50 {
            let along = f64::from(step) / 50.0 * reach;
            for (x, y) in [(along, reach), (along, -reach), (reach, along), (-reach, along)] {
                let [x, y] = page_from_tag(x, y).map(|mm| (mm / MM_PER_PX) as u32);
                assert!(image.row(y)[x as usize] >= WHITE, "tag {id}: ink in its margin at {x}, {y} px");
            }
        }
    }
}

#[test]
fn boards_are_read_back_from_the_printed_page() {
    let spec = spec();
    for page in [
        boards::grid(&spec.board, &spec.paper).expect("fits"),
        boards::checkerboard(&spec.checkerboard, &spec.paper).expect("fits"),
    ] {
        assert!(page.tags.len() >= 27);
        judge(&page, &svg_image(&page));
        judge(&page, &pdf_image(&page));
    }
}

#[test]
fn sheets_and_nets_of_every_shell_are_read_back_from_the_printed_page() {
    let spec = spec();
    for shell in design::draw(&spec.dimensions()).shells {
        let stickers = sheets::pages(&shell, &spec.paper).expect("fits");
        let nets = net::pages(&shell, &spec).expect("fits");
        for pages in [&stickers, &nets] {
            let mut ids: Vec<u32> = pages.iter().flat_map(|page| &page.tags).map(|tag| tag.id).collect();
            ids.sort_unstable();
            assert_eq!(ids, shell.tags.iter().map(|tag| tag.id).collect::<Vec<_>>(), "{}", shell.name);
        }
        for page in stickers.iter().chain(&nets) {
            judge(page, &svg_image(page));
        }
    }
}
