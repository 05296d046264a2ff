//! Random seed of a run, and named streams.
//!
//! Each source of noise has a separate stream, named after the quantity it disturbs (`"imu/gyro/white"`). A stream depends
//! on seed and name only: a new source, or more draws from one stream, does not change the others.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Generator of all streams: ChaCha with eight rounds, with the same bytes on every machine.
pub type Stream = ChaCha8Rng;

/// Random seed of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(transparent)]
pub struct Seed(pub u64);

impl Seed {
    /// The stream `name`.
    pub fn stream(self, name: &str) -> Stream {
        let mut state = splitmix(self.0 ^ fnv1a(name.as_bytes()));
        let mut key = [0_u8; 32];
        for word in key.chunks_exact_mut(8) {
            state = splitmix(state);
            word.copy_from_slice(&state.to_le_bytes());
        }
        Stream::from_seed(key)
    }

    /// Part `index` of the stream `name`: parts are independent and can be drawn on any thread.
    pub fn part(self, name: &str, index: u64) -> Stream {
        let mut stream = self.stream(name);
        stream.set_stream(index);
        stream
    }

    /// Seed of a sub-run (a point of a sweep, a scatter of objects).
    pub fn child(self, name: &str) -> Seed {
        Seed(splitmix(splitmix(self.0) ^ fnv1a(name.as_bytes())))
    }
}

/// FNV-1a, 64 bits (Fowler, Noll, Vo): hashes the name into the seed.
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

/// SplitMix64 (Steele, Lea, Flood 2014): a bijection that mixes all bits.
fn splitmix(state: u64) -> u64 {
    let mut z = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::Rng;

    #[test]
    fn streams_depend_on_seed_and_name_alone() {
        let draw = |seed: u64, name: &str| Seed(seed).stream(name).next_u64();
        assert_eq!(draw(1, "imu/gyro"), draw(1, "imu/gyro"));
        assert_ne!(draw(1, "imu/gyro"), draw(2, "imu/gyro"));
        assert_ne!(draw(1, "imu/gyro"), draw(1, "imu/accel"));
        assert_ne!(Seed(1).part("lidar", 0).next_u64(), Seed(1).part("lidar", 1).next_u64());
    }

    #[test]
    fn fnv_matches_its_published_vector() {
        // Test vector of the FNV authors: 64-bit FNV-1a of "foobar".
        assert_eq!(fnv1a(b"foobar"), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn splitmix_matches_its_published_sequence() {
        // First output of the reference SplitMix64 seeded with 1234567.
        assert_eq!(splitmix(1_234_567), 6_457_827_717_110_365_317);
    }
}
