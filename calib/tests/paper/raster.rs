//! Reads the filled shapes and lines of our SVG and PDF files and draws them with exact coverage of each pixel.
//!
//! It knows only what such files hold: absolute paths of straight lines, grey fills, strokes. Text is left out: it
//! stands outside the margins that the tests look at, and no font has to be installed.

use locoman_vision::image::GrayImage;

/// What is on a page: millimetres, y down.
pub struct Ink {
    size_mm: [f64; 2],
    /// Outlines that are filled together, with their grey (0 black, 1 white).
    fills: Vec<(Vec<Vec<[f64; 2]>>, f64)>,
}

impl Ink {
    /// The shapes of an SVG file whose unit is the millimetre.
    pub fn of_svg(text: &str) -> Self {
        let attribute = |element: &str, name: &str| -> Option<String> {
            let start = element.find(&format!(" {name}=\""))? + name.len() + 3;
            Some(element[start..].split('"').next()?.to_owned())
        };
        let grey = |colour: &str| -> f64 {
            f64::from(u8::from_str_radix(colour.get(1..3).expect("#rrggbb"), 16).expect("hexadecimal"))
                / 255.0
        };
        let head = text.split('>').next().expect("an element");
        let millimetres = |name: &str| -> f64 {
            attribute(head, name).and_then(|size| size.strip_suffix("mm")?.parse().ok()).expect("millimetres")
        };
        let size_mm = [millimetres("width"), millimetres("height")];
        assert_eq!(attribute(head, "viewBox"), Some(format!("0 0 {} {}", size_mm[0], size_mm[1])));
        let mut fills = Vec::new();
        for element in text.split('<').filter(|element| element.starts_with("path")) {
            let outlines: Vec<Vec<[f64; 2]>> = attribute(element, "d")
                .expect("a path")
                .split('M')
                .skip(1)
                .map(|part| part.trim_end_matches('Z').split('L').map(pair).collect())
                .collect();
            match attribute(element, "fill").as_deref() {
                Some("none") => {
                    let width_mm: f64 =
                        attribute(element, "stroke-width").expect("a width").parse().expect("a number");
                    let shade = grey(&attribute(element, "stroke").expect("a colour"));
                    fills.extend(outlines.iter().flat_map(|line| stroke(line, width_mm, shade)));
                }
                colour => fills.push((outlines, grey(colour.expect("a colour")))),
            }
        }
        Self { size_mm, fills }
    }

    /// The shapes of a PDF of one page.
    pub fn of_pdf(bytes: &[u8]) -> Self {
        const MM_PER_POINT: f64 = 25.4 / 72.0;
        let text = String::from_utf8_lossy(bytes);
        let media = text.split("/MediaBox [").nth(1).and_then(|rest| rest.split(']').next()).expect("a page");
        let sizes: Vec<f64> = media.split_whitespace().map(|n| n.parse().expect("a number")).collect();
        let size_mm = [sizes[2] * MM_PER_POINT, sizes[3] * MM_PER_POINT];
        let content = text.split("stream\n").nth(1).and_then(|rest| rest.split("\nendstream").next());
        let (mut outlines, mut fills): (Vec<Vec<[f64; 2]>>, Vec<_>) = (Vec::new(), Vec::new());
        let (mut fill_grey, mut stroke_grey, mut width_mm) = (0.0, 0.0, 0.0);
        for line in content.expect("a content").lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            let number = |k: usize| -> f64 { words[k].parse().expect("a number") };
            let point = || [number(0) * MM_PER_POINT, size_mm[1] - number(1) * MM_PER_POINT];
            match words.last().copied() {
                Some("m") => outlines.push(vec![point()]),
                Some("l") => outlines.last_mut().expect("a path").push(point()),
                Some("g") => fill_grey = number(0),
                Some("G") => stroke_grey = number(0),
                Some("w") => width_mm = number(0) * MM_PER_POINT,
                Some("f") => fills.push((std::mem::take(&mut outlines), fill_grey)),
                Some("S") => {
                    let lines = std::mem::take(&mut outlines);
                    fills.extend(lines.iter().flat_map(|line| stroke(line, width_mm, stroke_grey)));
                }
                _ => {}
            }
        }
        Self { size_mm, fills }
    }
}

fn pair(text: &str) -> [f64; 2] {
    let mut numbers = text.split(' ').map(|n| n.parse().expect("a number"));
    [numbers.next().expect("x"), numbers.next().expect("y")]
}

/// A line as one rectangle a segment (dashes are drawn through: more ink than there will be).
fn stroke(line: &[[f64; 2]], width_mm: f64, grey: f64) -> Vec<(Vec<Vec<[f64; 2]>>, f64)> {
    line.windows(2)
        .map(|ends| {
            let [a, b] = [ends[0], ends[1]];
            let length = (b[0] - a[0]).hypot(b[1] - a[1]).max(1e-9);
            let across = [-(b[1] - a[1]), b[0] - a[0]].map(|d| d / length * width_mm / 2.0);
            let corner = |p: [f64; 2], side: f64| [p[0] + side * across[0], p[1] + side * across[1]];
            (vec![vec![corner(a, -1.0), corner(b, -1.0), corner(b, 1.0), corner(a, 1.0)]], grey)
        })
        .collect()
}

/// The page at a resolution; each pixel has the mean of what covers it.
pub fn rasterise(ink: &Ink, dpi: f64) -> GrayImage {
    let scale = dpi / 25.4;
    let [width, height] = ink.size_mm.map(|length| (length * scale).round() as usize);
    let mut page = vec![1.0_f32; width * height];
    for (outlines, grey) in &ink.fills {
        fill(&mut page, width, height, outlines, scale, *grey);
    }
    let data = page.iter().map(|level| (level * 255.0).round() as u8).collect();
    GrayImage::new(width as u32, height as u32, data).expect("sizes agree")
}

/// Signed areas to the right of each edge, summed along rows: exact coverage for outlines that do not overlap.
fn fill(page: &mut [f32], width: usize, height: usize, outlines: &[Vec<[f64; 2]>], scale: f64, grey: f64) {
    let points = outlines.iter().flatten();
    let (low, high) =
        points.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p[1]), high.max(p[1])));
    let rows = (low * scale).floor().max(0.0) as usize..((high * scale).ceil().max(0.0) as usize).min(height);
    for y in rows {
        let mut change = vec![0.0_f64; width + 2];
        for outline in outlines {
            for (a, b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
                let (a, b) = ([a[0] * scale, a[1] * scale], [b[0] * scale, b[1] * scale]);
                edge(&mut change, a, b, y as f64, width);
            }
        }
        let mut sum = 0.0;
        for x in 0..width {
            sum += change[x];
            let cover = sum.abs().min(1.0) as f32;
            let pixel = &mut page[y * width + x];
            *pixel += (grey as f32 - *pixel) * cover;
        }
    }
}

/// Adds what one edge covers of a row: it fills everything to its right.
fn edge(change: &mut [f64], a: [f64; 2], b: [f64; 2], y: f64, width: usize) {
    let (top, bottom, sign) = if a[1] < b[1] { (a, b, 1.0) } else { (b, a, -1.0) };
    let (from, to) = (top[1].max(y), bottom[1].min(y + 1.0));
    if from >= to {
        return;
    }
    let x_at = |level: f64| top[0] + (level - top[1]) / (bottom[1] - top[1]) * (bottom[0] - top[0]);
    // Thin slices: within one, the edge stays inside a pixel or is nearly upright.
    let slices = 1 + (x_at(to) - x_at(from)).abs().ceil() as usize;
    for slice in 0..slices {
        let level = |k: usize| from + (to - from) * k as f64 / slices as f64;
        let x = (0.5 * (x_at(level(slice)) + x_at(level(slice + 1)))).clamp(0.0, width as f64);
        let tall = sign * (to - from) / slices as f64;
        let (pixel, inside) = (x.floor() as usize, x - x.floor());
        change[pixel] += tall * (1.0 - inside);
        change[pixel + 1] += tall * inside;
    }
}
