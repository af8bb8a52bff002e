//! Sums of monomials with constant coefficients, and their common parts.

use std::cmp::{Ordering, Reverse};
use std::collections::{BTreeMap, HashMap};

use crate::ir::constant::Constant;
use crate::ir::graph::NodeId;

/// A product of powers of atoms, sorted by atom.
pub(super) type Monomial = Vec<(NodeId, i32)>;

/// A sum of monomials with constant coefficients; the empty sum is zero.
pub(super) type Sum = BTreeMap<Monomial, Constant>;

pub(super) fn multiply(a: &Monomial, b: &Monomial) -> Monomial {
    let mut product = Monomial::with_capacity(a.len() + b.len());
    let (mut a, mut b) = (a.iter().copied().peekable(), b.iter().copied().peekable());
    // Both are sorted by atom, and merging keeps the order.
    while let (Some(&x), Some(&y)) = (a.peek(), b.peek()) {
        let factor = match x.0.cmp(&y.0) {
            Ordering::Less => a.next(),
            Ordering::Greater => b.next(),
            Ordering::Equal => a
                .next()
                .zip(b.next())
                .map(|((atom, j), (_, k))| (atom, j + k)),
        };
        product.extend(factor.filter(|&(_, exponent)| exponent != 0));
    }
    product.extend(a);
    product.extend(b);
    product
}

pub(super) fn divide(monomial: &Monomial, atoms: &[NodeId]) -> Monomial {
    let divisor = atoms.iter().fold(Monomial::new(), |product, &atom| {
        multiply(&product, &vec![(atom, -1)])
    });
    multiply(monomial, &divisor)
}

pub(super) fn times(monomial: &Monomial, atoms: &[NodeId]) -> Monomial {
    atoms.iter().fold(monomial.clone(), |product, &atom| {
        multiply(&product, &vec![(atom, 1)])
    })
}

pub(super) fn add_term(sum: &mut Sum, monomial: Monomial, coefficient: Constant) {
    let total = sum.get(&monomial).copied().unwrap_or(Constant::from(0)) + coefficient;
    if total.is_zero() {
        sum.remove(&monomial);
    } else {
        sum.insert(monomial, total);
    }
}

pub(super) fn constant_sum(value: Constant) -> Sum {
    let mut sum = Sum::new();
    add_term(&mut sum, Monomial::new(), value);
    sum
}

pub(super) fn scale(sum: &Sum, factor: Constant) -> Sum {
    sum.iter()
        .map(|(monomial, &coefficient)| (monomial.clone(), coefficient * factor))
        .collect()
}

pub(super) fn single(sum: &Sum) -> Option<(&Monomial, Constant)> {
    match sum.len() {
        1 => sum
            .iter()
            .next()
            .map(|(monomial, &coefficient)| (monomial, coefficient)),
        _ => None,
    }
}

pub(super) fn exponent_of(monomial: &Monomial, atom: NodeId) -> i32 {
    monomial
        .iter()
        .find(|&&(other, _)| other == atom)
        .map_or(0, |&(_, exponent)| exponent)
}

/// The factor that all terms share.
pub(super) fn common_factor(sum: &Sum) -> Monomial {
    let mut terms = sum.keys();
    let first = terms.next().cloned().unwrap_or_default();
    let shared = terms.fold(first, |shared, monomial| {
        let kept = shared
            .into_iter()
            .map(|(atom, exponent)| (atom, exponent.min(exponent_of(monomial, atom))));
        kept.filter(|&(_, exponent)| exponent > 0).collect()
    });
    shared
        .into_iter()
        .filter(|&(_, exponent)| exponent > 0)
        .collect()
}

/// The coefficient by which a sum is divided, so that all its multiples are one sum.
///
/// Its magnitude is the most frequent one, because those terms then need no multiplication; among
/// equals that of the term with the fewest factors. Its sign is that of the term with the most
/// factors, which makes the kernels shortest. It is rational, because other numbers would round.
pub(super) fn unit_of(sum: &Sum) -> Constant {
    let mut counts: HashMap<Constant, usize> = HashMap::new();
    for coefficient in sum.values() {
        *counts.entry(coefficient.abs()).or_default() += 1;
    }
    let factors = |monomial: &Monomial| -> u32 {
        let exponents = monomial.iter().map(|(_, exponent)| exponent.unsigned_abs());
        exponents.sum()
    };
    let rarity = |(monomial, coefficient): &(&Monomial, &Constant)| {
        (Reverse(counts[&coefficient.abs()]), factors(monomial))
    };
    let (_, frequent) = sum.iter().min_by_key(rarity).expect("a sum has terms");
    let length = |(monomial, _): &(&Monomial, &Constant)| Reverse(factors(monomial));
    let (_, longest) = sum.iter().min_by_key(length).expect("a sum has terms");
    let magnitude = match frequent {
        Constant::Rational(_) => frequent.abs(),
        Constant::Float(_) => Constant::from(1),
    };
    match longest.is_negative() {
        true => -magnitude,
        false => magnitude,
    }
}

/// The magnitude that all coefficients share, if it is not one.
pub(super) fn common_magnitude(sum: &Sum) -> Option<Constant> {
    let mut magnitudes = sum.values().map(|coefficient| coefficient.abs());
    let first = magnitudes.next()?;
    (!first.is_one() && magnitudes.all(|other| other == first)).then_some(first)
}

/// The atom that occurs in most terms, if it occurs in more than one; the oldest among equals.
pub(super) fn frequent_factor(sum: &Sum) -> Option<NodeId> {
    let mut counts: BTreeMap<NodeId, usize> = BTreeMap::new();
    for monomial in sum.keys() {
        for &(atom, _) in monomial.iter().filter(|&&(_, exponent)| exponent > 0) {
            *counts.entry(atom).or_default() += 1;
        }
    }
    let most = counts.values().copied().max().filter(|&count| count > 1)?;
    counts
        .into_iter()
        .find(|&(_, count)| count == most)
        .map(|(atom, _)| atom)
}
