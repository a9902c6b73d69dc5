//! Arbitrary bytes as numbers and as settings.

use num_complex::Complex64;

/// Bytes that choose, and the numbers that the rest of them are.
pub struct Given {
    choice: Vec<u8>,
    /// From the smallest to the largest, and what is none.
    pub values: Vec<f64>,
}

impl Given {
    /// The first `choices` bytes choose; bit 0 of the last of them takes the rest as raw numbers, else they are single bytes times a power of
    /// ten that the last but one says. At most `most` numbers, so that no execution is slow. `None` if there are too few bytes.
    pub fn of(data: &[u8], choices: usize, most: usize) -> Option<Self> {
        let (choice, rest) = data.split_at_checked(choices)?;
        let values = if choice[choices - 1] & 1 != 0 {
            rest.chunks_exact(8).take(most).filter_map(|bytes| bytes.try_into().ok()).map(f64::from_le_bytes).collect()
        } else {
            let scale = 10f64.powi(i32::from(choice[choices - 2] as i8) * 2);
            rest.iter().take(most).map(|b| (f64::from(*b) - 127.0) * scale).collect()
        };
        Some(Given { choice: choice.to_vec(), values })
    }

    /// Choice `at` of `of`.
    pub fn choose(&self, at: usize, of: usize) -> usize {
        usize::from(self.choice[at]) % of
    }

    /// Whether choice `at` has this bit.
    pub fn bit(&self, at: usize, bit: u8) -> bool {
        self.choice[at] >> bit & 1 != 0
    }

    /// One of `all`, as choice `at` has it.
    pub fn one_of<T: Clone>(&self, at: usize, all: &[T]) -> T {
        all[self.choose(at, all.len())].clone()
    }

    /// Number `at` of those given, counted round and round; 0 where there is none.
    pub fn value(&self, at: usize) -> f64 {
        self.values.get(at % self.values.len().max(1)).copied().unwrap_or_default()
    }

    /// Two of them.
    pub fn complex(&self, at: usize) -> Complex64 {
        Complex64::new(self.value(2 * at), self.value(2 * at + 1))
    }

    /// All of them as so many columns of equal length.
    pub fn columns(&self, count: usize) -> Vec<Vec<f64>> {
        let samples = self.values.len() / count;
        (0..count).map(|c| self.values[c * samples..(c + 1) * samples].to_vec()).collect()
    }
}
