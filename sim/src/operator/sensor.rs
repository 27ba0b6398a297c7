//! From light on the pixels to grey levels: vignetting, lens blur, shot and read noise, quantization.

use super::lens::RayTable;
use super::scene::Sensor;

/// Develops the images of one camera.
#[derive(Debug, Clone)]
pub struct Developer {
    width: usize,
    sensor: Sensor,
    /// Grey levels per unit of light at each pixel.
    gain: Vec<f32>,
    /// One side of the symmetric blur kernel, its centre first.
    kernel: Vec<f32>,
    /// Standard deviation of the noise at each grey level of signal.
    noise: [f32; 256],
}

/// The blur reaches this many pixels, or this many standard deviations if that is farther.
const LEAST_RADIUS_PX: usize = 3;
const REACH: f64 = 3.5;

/// One step of the splitmix64 generator: a well mixed function of its input.
#[inline]
pub fn mix(seed: u64) -> u64 {
    let z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Developer {
    /// Prepares for a camera of this width, given its rays.
    pub fn new(sensor: &Sensor, rays: &RayTable, width: usize, height: usize) -> Self {
        let gain = (0..width * height)
            .map(|at| {
                let [x, y] = rays.corner(at % width, at / width);
                let loss = sensor.vignetting as f32 * (x * x + y * y);
                (sensor.white_level - sensor.black_level) as f32 / (1.0 + loss)
            })
            .collect();
        let weight = |i: usize| match sensor.defocus_px {
            0.0 => f64::from(u8::from(i == 0)),
            sigma => (-0.5 * (i as f64 / sigma).powi(2)).exp(),
        };
        let radius = LEAST_RADIUS_PX.max((REACH * sensor.defocus_px).ceil() as usize);
        let total = weight(0) + 2.0 * (1..=radius).map(weight).sum::<f64>();
        let kernel = (0..=radius).map(|i| (weight(i) / total) as f32).collect();
        let noise = std::array::from_fn(|level| {
            let signal = (level as f64 - sensor.black_level).max(0.0);
            (sensor.read_noise.powi(2) + sensor.shot_noise * signal).sqrt() as f32
        });
        Self { width, sensor: sensor.clone(), gain, kernel, noise }
    }

    /// The picture; `brightness` is a factor on the light, `seed` decides the noise.
    pub fn develop(&self, light: &[f32], brightness: f32, seed: u64) -> Vec<u8> {
        let blurred = self.blur(light);
        let black = self.sensor.black_level as f32;
        let mut grey = vec![0; blurred.len()];
        let lines = blurred.chunks(self.width).zip(self.gain.chunks(self.width));
        for (row, (line, (light, gain))) in grey.chunks_mut(self.width).zip(lines).enumerate() {
            let start = mix(seed ^ mix(row as u64));
            for (column, (pixel, (light, gain))) in line.iter_mut().zip(light.iter().zip(gain)).enumerate() {
                let signal = black + light * gain * brightness;
                let deviation = self.noise[(signal as usize).min(255)];
                let noise = gaussian(mix(start.wrapping_add(column as u64)));
                // A cast saturates at 0 and 255.
                *pixel = (signal + deviation * noise + 0.5) as u8;
            }
        }
        grey
    }

    /// Convolution with the point-spread function, rows then columns; borders repeat the last pixel.
    fn blur(&self, light: &[f32]) -> Vec<f32> {
        let (center, sides) = (self.kernel[0], &self.kernel[1..]);
        let (width, radius) = (self.width, sides.len());
        let mut across = vec![0.0f32; light.len()];
        let mut padded = vec![0.0f32; width + 2 * radius];
        for (line, out) in light.chunks(width).zip(across.chunks_mut(width)) {
            padded[..radius].fill(line[0]);
            padded[radius..radius + width].copy_from_slice(line);
            padded[radius + width..].fill(line[width - 1]);
            let shifted = |by: usize| &padded[by..by + width];
            scale(out, line, center);
            for (i, weight) in sides.iter().enumerate() {
                add_pair(out, shifted(radius - 1 - i), shifted(radius + 1 + i), *weight);
            }
        }
        let last = light.len() / width - 1;
        let line = |row: usize| &across[row * width..(row + 1) * width];
        let mut down = vec![0.0f32; light.len()];
        for (row, out) in down.chunks_mut(width).enumerate() {
            scale(out, line(row), center);
            for (i, weight) in sides.iter().enumerate() {
                let (above, below) = (row.saturating_sub(i + 1), (row + i + 1).min(last));
                add_pair(out, line(above), line(below), *weight);
            }
        }
        down
    }
}

fn scale(out: &mut [f32], line: &[f32], weight: f32) {
    for (out, value) in out.iter_mut().zip(line) {
        *out = weight * value;
    }
}

fn add_pair(out: &mut [f32], a: &[f32], b: &[f32], weight: f32) {
    for (out, (a, b)) in out.iter_mut().zip(a.iter().zip(b)) {
        *out += weight * (a + b);
    }
}

/// A number of zero mean and unit variance from 64 random bits: the sum of four uniform ones, whose
/// distribution is normal up to 3.4 standard deviations.
#[inline]
pub fn gaussian(bits: u64) -> f32 {
    // Four numbers of 16 bits have the variance 4 * 2^32 / 12.
    const UNIT: f32 = 1.732_050_8 / 65536.0;
    let sum = (bits & 0xffff) + (bits >> 16 & 0xffff) + (bits >> 32 & 0xffff) + (bits >> 48);
    (sum as f32 - 2.0 * 65535.0) * UNIT
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noise_has_zero_mean_and_unit_variance() {
        let n = 200_000;
        let draws: Vec<f64> = (0..n).map(|i| f64::from(gaussian(mix(i)))).collect();
        let mean = draws.iter().sum::<f64>() / n as f64;
        let variance = draws.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n as f64;
        // Four standard errors of each.
        assert!(mean.abs() < 0.009, "{mean}");
        assert!((variance - 1.0).abs() < 0.013, "{variance}");
    }
}
