//! The points within a step at which forces are evaluated: its beginning, and the four nodes of Radau IIA, the last of
//! which is its end.
//!
//! ```text
//! f(s) = Σ_p f_p ℓ_p(s),   s = 0 … 1,   ℓ_p being 1 at point p and 0 at the other four
//! ```

/// Nodes at which forces are unknown before the step is solved.
pub(super) const NODES: usize = 4;

/// Nodes and the beginning of the step.
pub(super) const POINTS: usize = NODES + 1;

/// One number for each node.
pub(super) type Lane = [f64; NODES];

/// Derivatives of a force at each node with respect to an argument at each node.
pub(super) type Slopes = [Lane; NODES];

/// Zeros of P₄(2s − 1) − P₃(2s − 1), P being Legendre's polynomials.
pub(super) const C: Lane = [0.088_587_959_512_703_95, 0.409_466_864_440_734_7, 0.787_659_461_760_847, 1.0];

/// Beginning and nodes.
pub(super) const PLACES: [f64; POINTS] = [0.0, C[0], C[1], C[2], C[3]];

/// Largest ‖A‖ h of a step, and the order of its series: 4³³/33! is 9e-18 of the leading term, and the largest term,
/// 11, costs one digit.
pub(super) const REACH: f64 = 4.0;
const ORDERS: [(f64, usize); 6] = [(0.25, 12), (0.55, 15), (1.15, 19), (2.0, 23), (3.0, 28), (REACH, 33)];

/// Room for its terms.
pub(super) const TERMS: usize = 34;

/// The order of the series for ‖A‖ h.
pub(super) fn order(reach: f64) -> usize {
    ORDERS.iter().find(|(most, _)| reach <= *most).map_or(TERMS - 1, |(_, order)| *order)
}

/// Number of powers of time: of forces, which are quartic, and of inputs.
pub(super) const POWERS: usize = crate::signal::DEGREE + 1;

/// Coefficients of ℓ_p by powers of s: `[power][point]`.
pub(super) const MONOMIALS: [[f64; POINTS]; POINTS] = inverse(PLACES);

/// Derivatives of ℓ_p at the beginning and at the end of a step.
pub(super) const SLOPES: [[f64; POINTS]; 2] = {
    let (mut slopes, mut p) = ([MONOMIALS[1], [0.0; POINTS]], 0);
    while p < POINTS {
        let mut k = 1;
        while k < POINTS {
            slopes[1][p] += k as f64 * MONOMIALS[k][p];
            k += 1;
        }
        p += 1;
    }
    slopes
};

/// Coefficients of ω(s) = s ∏ (s − c_i), by powers of s: the shape of what a quartic through the points leaves of a
/// force whose fifth derivative does not change.
const REST: [f64; POINTS + 1] = {
    let (mut product, mut p) = ([0.0; POINTS + 1], 0);
    product[0] = 1.0;
    while p < POINTS {
        let mut k = p + 1;
        while k > 0 {
            product[k] = product[k - 1] - PLACES[p] * product[k];
            k -= 1;
        }
        product[0] *= -PLACES[p];
        p += 1;
    }
    product
};

/// ω(s).
#[inline(always)]
pub(super) fn rest(s: f64) -> f64 {
    PLACES.iter().fold(1.0, |product, place| product * (s - place))
}

/// Coefficients of the cubics through the nodes alone.
const CUBICS: [[f64; NODES]; NODES] = inverse(C);

/// Values at the beginning of the cubics that are 1 at one node and 0 at the others.
pub(super) const BACKWARD: Lane = CUBICS[0];

/// Radau's matrix: ∫ from 0 to c_i of the cubic of node j.
pub(super) const RADAU: [Lane; NODES] = {
    let mut matrix = [[0.0; NODES]; NODES];
    let mut i = 0;
    while i < NODES {
        let mut j = 0;
        while j < NODES {
            let (mut k, mut power) = (0, 1.0);
            while k < NODES {
                power *= C[i];
                matrix[i][j] += CUBICS[k][j] * power / (k + 1) as f64;
                k += 1;
            }
            j += 1;
        }
        i += 1;
    }
    matrix
};

/// Weights of the quartic through the beginning and the nodes: ∫ from 0 to c_i of ℓ_p.
pub(super) const QUARTIC: [[f64; POINTS]; NODES] = {
    let mut matrix = [[0.0; POINTS]; NODES];
    let mut i = 0;
    while i < NODES {
        let mut p = 0;
        while p < POINTS {
            let (mut k, mut power) = (0, 1.0);
            while k < POINTS {
                power *= C[i];
                matrix[i][p] += MONOMIALS[k][p] * power / (k + 1) as f64;
                k += 1;
            }
            p += 1;
        }
        i += 1;
    }
    matrix
};

/// c_iᵏ at each node.
pub(super) static POWER: [Lane; TERMS + POWERS] = {
    let mut table = [[1.0; NODES]; TERMS + POWERS];
    let mut k = 1;
    while k < TERMS + POWERS {
        let mut i = 0;
        while i < NODES {
            table[k][i] = table[k - 1][i] * C[i];
            i += 1;
        }
        k += 1;
    }
    table
};

/// c_iᵐ/m!: what the m-th power of A h does until each node.
pub(super) static FREE: [Lane; TERMS] = {
    let mut table = [[1.0; NODES]; TERMS];
    let mut m = 1;
    while m < TERMS {
        let mut i = 0;
        while i < NODES {
            table[m][i] = table[m - 1][i] * C[i] / m as f64;
            i += 1;
        }
        m += 1;
    }
    table
};

/// ∫ from 0 to c_i of (c_i − σ)ᵐ/m! σᵏ dσ = k!/(m + k + 1)! c_iᵐ⁺ᵏ⁺¹: effect of a force σᵏ by the m-th power.
pub(super) static FORCED: [[Lane; TERMS]; POWERS] = {
    let mut table = [[[0.0; NODES]; TERMS]; POWERS];
    let mut k = 0;
    while k < POWERS {
        // k!/(m + k + 1)!, from m = 0 on
        let (mut factor, mut m) = (1.0 / (k + 1) as f64, 0);
        while m < TERMS {
            let mut i = 0;
            while i < NODES {
                table[k][m][i] = factor * POWER[m + k + 1][i];
                i += 1;
            }
            m += 1;
            factor /= (m + k + 1) as f64;
        }
        k += 1;
    }
    table
};

/// Integrals of a force ℓ_p, followed by that of ω: `[m][p]`.
pub(super) static DRIVEN: [[Lane; POINTS + 1]; TERMS] = {
    let mut table = [[[0.0; NODES]; POINTS + 1]; TERMS];
    let mut m = 0;
    while m < TERMS {
        let mut p = 0;
        while p <= POINTS {
            let mut i = 0;
            while i < NODES {
                let mut k = 0;
                while k <= POINTS {
                    let coefficient = if p == POINTS {
                        REST[k]
                    } else if k < POINTS {
                        MONOMIALS[k][p]
                    } else {
                        0.0
                    };
                    table[m][p][i] += coefficient * FORCED[k][m][i];
                    k += 1;
                }
                i += 1;
            }
            p += 1;
        }
        m += 1;
    }
    table
};

/// The inverse of V_{ik} = x_iᵏ: from values at `x` to coefficients, `[power][place]`. Gauss-Jordan elimination with
/// exchange of rows.
pub(super) const fn inverse<const N: usize>(x: [f64; N]) -> [[f64; N]; N] {
    let mut v = [[0.0; N]; N];
    let mut w = [[0.0; N]; N];
    let mut k = 0;
    while k < N {
        let mut power = 1.0;
        let mut j = 0;
        while j < N {
            v[k][j] = power;
            power *= x[k];
            j += 1;
        }
        w[k][k] = 1.0;
        k += 1;
    }
    let mut column = 0;
    while column < N {
        let (mut best, mut row) = (column, column);
        while row < N {
            if v[row][column].abs() > v[best][column].abs() {
                best = row;
            }
            row += 1;
        }
        (v[column], v[best]) = (v[best], v[column]);
        (w[column], w[best]) = (w[best], w[column]);
        let pivot = v[column][column];
        let mut j = 0;
        while j < N {
            v[column][j] /= pivot;
            w[column][j] /= pivot;
            j += 1;
        }
        row = 0;
        while row < N {
            let factor = v[row][column];
            if row != column && factor != 0.0 {
                j = 0;
                while j < N {
                    v[row][j] -= factor * v[column][j];
                    w[row][j] -= factor * w[column][j];
                    j += 1;
                }
            }
            row += 1;
        }
        column += 1;
    }
    w
}

/// A change that is this share of the tolerance counts as found.
pub(super) const FOUND: f64 = 0.01;

/// The powers of the quartic through five values.
#[inline(always)]
pub(super) fn monomials(values: &[f64; POINTS]) -> [f64; POINTS] {
    let mut powers = [0.0; POINTS];
    for (power, row) in powers.iter_mut().zip(&MONOMIALS) {
        for (weight, value) in row.iter().zip(values) {
            *power += weight * value;
        }
    }
    powers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_integrated_to_each_node() {
        // ∫ σ³ from 0 to c_i by Radau's matrix, and of a quartic by the five points
        for i in 0..NODES {
            let cubic: f64 = (0..NODES).map(|j| RADAU[i][j] * C[j].powi(3)).sum();
            assert!((cubic - C[i].powi(4) / 4.0).abs() < 1e-15, "{cubic}");
            let quartic: f64 = (0..POINTS).map(|p| DRIVEN[0][p][i] * PLACES[p].powi(4)).sum();
            assert!((quartic - C[i].powi(5) / 5.0).abs() < 1e-15, "{quartic}");
        }
        // ω itself, and that it leaves nothing of the quadrature to the end: Radau's is exact for it.
        let s = 0.3;
        let by_powers = (0..=POINTS).map(|k| REST[k] * f64::powi(s, k as i32)).sum::<f64>();
        assert!((by_powers - rest(s)).abs() < 1e-16 && DRIVEN[0][POINTS][NODES - 1].abs() < 1e-16);
        let at_begin: f64 = (0..NODES).map(|j| BACKWARD[j] * (1.0 + C[j]).powi(3)).sum();
        assert!((at_begin - 1.0).abs() < 1e-13, "{at_begin}");
        assert_eq!((order(0.1), order(4.0)), (12, 33));
    }
}
