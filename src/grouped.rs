//! Items grouped by a number: a counting sort.

/// Items by a number below `n`: those of each number in their order, and where they begin, with the end.
pub(crate) fn grouped<T: Copy>(
    n: usize,
    items: impl Iterator<Item = (u32, T)> + Clone,
) -> (Vec<u32>, Vec<T>) {
    let mut starts = vec![0u32; n + 1];
    let Some((_, any)) = items.clone().next() else { return (starts, Vec::new()) };
    items.clone().for_each(|(number, _)| starts[number as usize + 1] += 1);
    for i in 0..n {
        starts[i + 1] += starts[i];
    }
    let mut next = starts.clone();
    let mut all = vec![any; starts[n] as usize];
    for (number, item) in items {
        let next = &mut next[number as usize];
        all[*next as usize] = item;
        *next += 1;
    }
    (starts, all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_of_a_number_stay_in_their_order() {
        let items = [(2, 'a'), (0, 'b'), (2, 'c'), (0, 'd'), (3, 'e')];
        let (starts, all) = grouped(5, items.into_iter());
        assert_eq!(starts, [0, 2, 2, 4, 5, 5]);
        assert_eq!(all, ['b', 'd', 'a', 'c', 'e']);
        assert_eq!(grouped(0, [].into_iter()), (vec![0], Vec::<u8>::new()));
    }
}
