//! The shells as paper to cut, fold and glue: their facets unfolded into the plane, tags printed on them.
//!
//! Convention: flat coordinates are millimetres, x right, y up, seen from outside the shell; pieces are then set on
//! pages. A flap is a strip at an edge that another facet of the solid is glued to; its ends slope by less than the
//! 30 degrees that a triangle leaves beside a square.

use std::collections::BTreeSet;

use locoman_vision::shells::Shell;
use nalgebra::{Point2, Point3, Rotation2, Vector2, Vector3};

use super::PrintError;
use super::drawing::{Drawing, LineKind, Mark, Page, TagPlace};
use super::facets::{Facet, Kind};
use super::ruler;
use super::spec::{Paper, Spec};

const FLAP_MM: f64 = 5.0;
/// Slope of a flap's ends, radians (25 degrees).
const FLAP_SLOPE_RAD: f64 = 0.436;
/// Edges nearer than this are one.
const SAME_MM: f64 = 1e-6;
/// Space between pieces.
const GAP_MM: f64 = 4.0;

/// A facet in the plane: maps points of the solid's facet to the paper.
#[derive(Debug, Clone)]
struct Flat {
    facet: usize,
    origin: Point3<f64>,
    right: Vector3<f64>,
    up: Vector3<f64>,
    at: Point2<f64>,
    turn: Rotation2<f64>,
}

impl Flat {
    fn map(&self, p: &Point3<f64>) -> Point2<f64> {
        let offset = p - self.origin;
        self.at + self.turn * Vector2::new(offset.dot(&self.right), offset.dot(&self.up))
    }
}

/// The pages of a shell's nets, and where the tags lie on each.
pub fn pages(shell: &Shell, spec: &Spec) -> Result<Vec<Page>, PrintError> {
    let kind = Kind::of(shell).ok_or_else(|| PrintError::UnknownShell { name: shell.name.clone() })?;
    let facets = kind.facets(spec);
    let pieces: Vec<Piece> = trees(kind).iter().map(|tree| Piece::new(&facets, tree, shell)).collect();
    let mut waiting: &[Piece] = &pieces;
    let mut all = Vec::new();
    while !waiting.is_empty() {
        let paper = &spec.paper;
        let turns = [[paper.width_mm, paper.height_mm], [paper.height_mm, paper.width_mm]];
        let filled = turns.map(|size_mm| fill(waiting, size_mm, paper));
        let [upright, turned] = filled;
        let best = if turned.len() > upright.len() { (turns[1], turned) } else { (turns[0], upright) };
        let (size_mm, corners) = best;
        if corners.is_empty() {
            return Err(PrintError::Paper {
                what: format!("the net of {}", shell.name),
                needs_mm: waiting[0].size_mm().into(),
                has_mm: turns[1].map(|length| length - 2.0 * paper.margin_mm),
            });
        }
        let (placed, rest) = waiting.split_at(corners.len());
        all.push(page(shell, placed, &corners, size_mm, paper)?);
        waiting = rest;
    }
    Ok(all)
}

/// Which facets hang together, root first, each with the one that it hangs on.
fn trees(kind: Kind) -> Vec<Vec<(usize, Option<usize>)>> {
    match kind {
        // The columns in one piece; each brace, which holds the bends, by itself.
        Kind::Torso => {
            vec![vec![(1, None), (0, Some(1)), (2, Some(1))], vec![(3, None)], vec![(4, None)]]
        }
        // Half of the belt each, with what stands on it: squares over even facets, triangles over odd ones.
        Kind::Palm | Kind::Thumb => [0, 4]
            .map(|first| {
                let mut tree = vec![(first, None)];
                tree.extend((first + 1..first + 4).map(|k| (k, Some(k - 1))));
                tree.extend((first..first + 4).map(|k| (8 + k / 2 + 4 * (k % 2), Some(k))));
                if first == 0 {
                    tree.push((16, Some(8)));
                }
                tree
            })
            .to_vec(),
    }
}

/// Facets that hang together, in the plane.
struct Piece {
    outlines: Vec<Vec<Point2<f64>>>,
    folds: Vec<[Point2<f64>; 2]>,
    flaps: Vec<[Point2<f64>; 4]>,
    /// Id, centre, direction of its x axis, side in millimetres.
    tags: Vec<(u32, Point2<f64>, Vector2<f64>, f64)>,
}

impl Piece {
    fn new(facets: &[Facet], tree: &[(usize, Option<usize>)], shell: &Shell) -> Self {
        let mut flats: Vec<Flat> = Vec::new();
        let mut folded: BTreeSet<(usize, usize)> = BTreeSet::new();
        let mut folds = Vec::new();
        for &(facet, parent) in tree {
            let parent = parent.and_then(|parent| flats.iter().find(|flat| flat.facet == parent));
            let shared =
                parent.and_then(|parent| Some((parent, shared_edge(&facets[parent.facet], &facets[facet])?)));
            let normal = facets[facet].normal();
            let flat = match shared {
                Some((parent, [a, b])) => {
                    let (flat_a, flat_b) = (parent.map(&a), parent.map(&b));
                    folded.insert((parent.facet.min(facet), parent.facet.max(facet)));
                    folds.push([flat_a, flat_b]);
                    laid(facet, a, b, normal, flat_a, flat_b)
                }
                // The root stands on its first edge.
                None => {
                    let corners = &facets[facet].corners;
                    let (a, b) = (corners[0], corners[1]);
                    laid(facet, a, b, normal, Point2::origin(), Point2::new((b - a).norm(), 0.0))
                }
            };
            flats.push(flat);
        }
        let outlines = flats
            .iter()
            .map(|flat| facets[flat.facet].corners.iter().map(|p| flat.map(p)).collect())
            .collect();
        let flaps = flats.iter().flat_map(|flat| flaps_of(flat, facets, &folded)).collect();
        let tags = flats
            .iter()
            .flat_map(|flat| facets[flat.facet].tags(shell).into_iter().map(move |tag| (flat, tag)))
            .map(|(flat, tag)| {
                let center = flat.map(&(tag.center() * 1e3));
                let right = flat.map(&(tag.center() * 1e3 + tag.shell_from_tag.rotation * Vector3::x()));
                (tag.id, center, right - center, 1e3 * tag.size_m)
            })
            .collect();
        Self { outlines, folds, flaps, tags }
    }

    /// The edges of facets that are neither folded nor hold a flap.
    fn cuts(&self) -> Vec<[Point2<f64>; 2]> {
        let same = |p: &Point2<f64>, q: &Point2<f64>| (p - q).norm() < SAME_MM;
        let inner: Vec<[Point2<f64>; 2]> =
            self.folds.iter().copied().chain(self.flaps.iter().map(|flap| [flap[0], flap[3]])).collect();
        let is_inner = |a: &Point2<f64>, b: &Point2<f64>| {
            inner.iter().any(|[p, q]| same(a, p) && same(b, q) || same(a, q) && same(b, p))
        };
        self.outlines
            .iter()
            .flat_map(|outline| outline.iter().zip(outline.iter().cycle().skip(1)))
            .filter(|(a, b)| !is_inner(a, b))
            .map(|(a, b)| [*a, *b])
            .collect()
    }

    /// Lower left and upper right corner.
    fn bounds(&self) -> (Point2<f64>, Point2<f64>) {
        let points = self.outlines.iter().flatten().chain(self.flaps.iter().flatten());
        let far = Point2::new(f64::INFINITY, f64::INFINITY);
        points.fold((far, -far), |(low, high), p| (low.inf(p), high.sup(p)))
    }

    fn size_mm(&self) -> Vector2<f64> {
        let (low, high) = self.bounds();
        high - low
    }
}

/// A facet with the edge from `a` to `b` laid on the paper.
fn laid(
    facet: usize,
    a: Point3<f64>,
    b: Point3<f64>,
    normal: Vector3<f64>,
    flat_a: Point2<f64>,
    flat_b: Point2<f64>,
) -> Flat {
    let right = (b - a).normalize();
    let along = flat_b - flat_a;
    let turn = Rotation2::new(along.y.atan2(along.x));
    Flat { facet, origin: a, right, up: normal.cross(&right), at: flat_a, turn }
}

/// The edge of one facet that another has too, in the first one's sense.
fn shared_edge(one: &Facet, other: &Facet) -> Option<[Point3<f64>; 2]> {
    let has = |p: &Point3<f64>| other.corners.iter().any(|q| (q - p).norm() < SAME_MM);
    let next = one.corners.iter().cycle().skip(1);
    one.corners.iter().zip(next).find(|(a, b)| has(a) && has(b)).map(|(a, b)| [*a, *b])
}

/// Flaps at the edges that are glued, on one of the two facets: a triangle's before a square's, then the later one's.
fn flaps_of(flat: &Flat, facets: &[Facet], folded: &BTreeSet<(usize, usize)>) -> Vec<[Point2<f64>; 4]> {
    let own = flat.facet;
    let rank = |facet: usize| (std::cmp::Reverse(facets[facet].corners.len()), facet);
    (0..facets.len())
        .filter(|&other| other != own && !folded.contains(&(own.min(other), own.max(other))))
        .filter(|&other| rank(own) > rank(other))
        .filter_map(|other| shared_edge(&facets[own], &facets[other]))
        .map(|[a, b]| {
            let (a, b) = (flat.map(&a), flat.map(&b));
            let along = (b - a).normalize();
            // The facet lies to the left of its edge.
            let outwards = Vector2::new(along.y, -along.x);
            let inset_mm = FLAP_MM / FLAP_SLOPE_RAD.tan();
            let (inset_mm, height_mm) = if 2.5 * inset_mm > (b - a).norm() {
                let inset_mm = (b - a).norm() / 2.5;
                (inset_mm, inset_mm * FLAP_SLOPE_RAD.tan())
            } else {
                (inset_mm, FLAP_MM)
            };
            let far = outwards * height_mm;
            [a, a + along * inset_mm + far, b - along * inset_mm + far, b]
        })
        .collect()
}

/// Upper left corners of as many pieces as a page takes, in rows.
fn fill(pieces: &[Piece], size_mm: [f64; 2], paper: &Paper) -> Vec<[f64; 2]> {
    let left = paper.margin_mm + ruler::WIDTH_MM;
    let right = size_mm[0] - paper.margin_mm;
    let bottom = size_mm[1] - paper.margin_mm - ruler::HEIGHT_MM;
    let (mut x, mut y, mut row_mm) = (left, paper.margin_mm, 0.0_f64);
    let mut corners = Vec::new();
    for piece in pieces {
        let size = piece.size_mm();
        if x + size.x > right {
            (x, y, row_mm) = (left, y + row_mm + GAP_MM, 0.0);
        }
        if x + size.x > right || y + size.y > bottom {
            break;
        }
        corners.push([x, y]);
        x += size.x + GAP_MM;
        row_mm = row_mm.max(size.y);
    }
    corners
}

fn page(
    shell: &Shell,
    pieces: &[Piece],
    corners: &[[f64; 2]],
    size_mm: [f64; 2],
    paper: &Paper,
) -> Result<Page, PrintError> {
    let mut page = Drawing::new(size_mm);
    let mut places = Vec::new();
    for (piece, [left, top]) in pieces.iter().zip(corners) {
        let (low, high) = piece.bounds();
        let place = |p: &Point2<f64>| [left + p.x - low.x, top + high.y - p.y];
        for [a, b] in piece.cuts() {
            page.line(place(&a), place(&b), LineKind::Cut);
        }
        for [a, b] in &piece.folds {
            page.line(place(a), place(b), LineKind::Fold);
        }
        for [a, far_a, far_b, b] in &piece.flaps {
            page.line(place(a), place(b), LineKind::Fold);
            let points = [a, far_a, far_b, b].map(place).to_vec();
            page.marks.push(Mark::Line { points, kind: LineKind::Cut });
        }
        for (id, center, right, side_mm) in &piece.tags {
            let tag =
                TagPlace { id: *id, center_mm: place(center), side_mm: *side_mm, right: [right.x, -right.y] };
            page.tag(&tag)?;
            places.push(tag);
        }
    }
    let bottom = size_mm[1] - paper.margin_mm - ruler::HEIGHT_MM + 2.0;
    let words = format!("{}: cut, fold back, glue the flaps", shell.name);
    ruler::draw(&mut page, [paper.margin_mm, bottom], &words);
    Ok(Page { drawing: page, tags: places })
}
