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
    kernel: [f32; RADIUS + 1],
    /// Standard deviation of the noise at each grey level of signal.
    noise: [f32; 256],
}

/// The blur reaches this many pixels.
const RADIUS: usize = 3;

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
        let total = weight(0) + 2.0 * (1..=RADIUS).map(weight).sum::<f64>();
        let kernel = std::array::from_fn(|i| (weight(i) / total) as f32);
        let noise = std::array::from_fn(|level| {
            let signal = (level as f64 - sensor.black_level).max(0.0);
            (sensor.read_noise.powi(2) + sensor.shot_noise * signal).sqrt() as f32
        });
        Self { width, sensor: sensor.clone(), gain, kernel, noise }
    }

    /// The picture; `seed` decides its noise.
    pub fn develop(&self, light: &[f32], seed: u64) -> Vec<u8> {
        let blurred = self.blur(light);
        let black = self.sensor.black_level as f32;
        let mut grey = vec![0; blurred.len()];
        let lines = blurred.chunks(self.width).zip(self.gain.chunks(self.width));
        for (row, (line, (light, gain))) in grey.chunks_mut(self.width).zip(lines).enumerate() {
            let start = mix(seed ^ mix(row as u64));
            for (column, (pixel, (light, gain))) in line.iter_mut().zip(light.iter().zip(gain)).enumerate() {
                let signal = black + light * gain;
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
        let [k0, k1, k2, k3] = self.kernel;
        let width = self.width;
        let mut across = vec![0.0f32; light.len()];
        let mut padded = vec![0.0f32; width + 2 * RADIUS];
        for (line, out) in light.chunks(width).zip(across.chunks_mut(width)) {
            padded[..RADIUS].fill(line[0]);
            padded[RADIUS..RADIUS + width].copy_from_slice(line);
            padded[RADIUS + width..].fill(line[width - 1]);
            for (p, out) in padded.windows(2 * RADIUS + 1).zip(out) {
                *out = k0 * p[3] + k1 * (p[2] + p[4]) + k2 * (p[1] + p[5]) + k3 * (p[0] + p[6]);
            }
        }
        let last = light.len() / width - 1;
        let line = |row: usize, offset: isize| {
            let row = row.saturating_add_signed(offset).min(last);
            &across[row * width..(row + 1) * width]
        };
        let mut down = vec![0.0f32; light.len()];
        for (row, out) in down.chunks_mut(width).enumerate() {
            let l: [&[f32]; 2 * RADIUS + 1] =
                std::array::from_fn(|i| line(row, i as isize - RADIUS as isize));
            for (x, out) in out.iter_mut().enumerate() {
                *out = k0 * l[3][x]
                    + k1 * (l[2][x] + l[4][x])
                    + k2 * (l[1][x] + l[5][x])
                    + k3 * (l[0][x] + l[6][x]);
            }
        }
        down
    }
}

/// A number of zero mean and unit variance from 64 random bits: the sum of four uniform ones, whose
/// distribution is normal up to 3.4 standard deviations.
#[inline]
fn gaussian(bits: u64) -> f32 {
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
