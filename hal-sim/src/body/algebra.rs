//! Vectors and matrices of the world's space, each entry a register of [`Lanes`].

use std::ops::{Add, Neg, Sub};

use super::lanes::Lanes;

/// A vector of three.
#[derive(Clone, Copy)]
pub struct Vec3<L>(pub [L; 3]);

/// A matrix by its columns.
#[derive(Clone, Copy)]
pub struct Mat3<L>(pub [Vec3<L>; 3]);

/// A symmetric matrix: xx, yy, zz, xy, xz, yz.
#[derive(Clone, Copy)]
pub struct Sym3<L>(pub [L; 6]);

impl<L: Lanes> Add for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        let a = self.0;
        Self([a[0] + b.0[0], a[1] + b.0[1], a[2] + b.0[2]])
    }
}

impl<L: Lanes> Sub for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        let a = self.0;
        Self([a[0] - b.0[0], a[1] - b.0[1], a[2] - b.0[2]])
    }
}

impl<L: Lanes> Neg for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self([-self.0[0], -self.0[1], -self.0[2]])
    }
}

impl<L: Lanes> Vec3<L> {
    /// The same number thrice.
    #[inline(always)]
    pub fn splat(value: L) -> Self {
        Self([value; 3])
    }

    /// Loads every lane.
    #[inline(always)]
    pub fn load(token: L::Token, store: &[L::Store; 3]) -> Self {
        Self([L::load(token, &store[0]), L::load(token, &store[1]), L::load(token, &store[2])])
    }

    /// Stores every lane.
    #[inline(always)]
    pub fn store(self) -> [L::Store; 3] {
        [self.0[0].store(), self.0[1].store(), self.0[2].store()]
    }

    /// `self·scale`.
    #[inline(always)]
    pub fn scale(self, scale: L) -> Self {
        Self([self.0[0] * scale, self.0[1] * scale, self.0[2] * scale])
    }

    /// `self·scale + to`.
    #[inline(always)]
    pub fn fma(self, scale: L, to: Self) -> Self {
        Self([self.0[0].fma(scale, to.0[0]), self.0[1].fma(scale, to.0[1]), self.0[2].fma(scale, to.0[2])])
    }

    /// The neighbours' vector: even and odd lanes change places.
    #[inline(always)]
    pub fn swap_halves(self) -> Self {
        Self([self.0[0].swap_halves(), self.0[1].swap_halves(), self.0[2].swap_halves()])
    }

    /// Scalar product.
    #[inline(always)]
    pub fn dot(self, b: Self) -> L {
        self.0[0].fma(b.0[0], self.0[1].fma(b.0[1], self.0[2] * b.0[2]))
    }

    /// `to − self·b`.
    #[inline(always)]
    pub fn dot_from(self, b: Self, to: L) -> L {
        (-self.0[2]).fma(b.0[2], (-self.0[1]).fma(b.0[1], (-self.0[0]).fma(b.0[0], to)))
    }

    /// Vector product.
    #[inline(always)]
    pub fn cross(self, b: Self) -> Self {
        let ([ax, ay, az], [bx, by, bz]) = (self.0, b.0);
        Self([ay.fma(bz, -(az * by)), az.fma(bx, -(ax * bz)), ax.fma(by, -(ay * bx))])
    }

    /// `self × b + to`.
    #[inline(always)]
    pub fn cross_add(self, b: Self, to: Self) -> Self {
        let ([ax, ay, az], [bx, by, bz]) = (self.0, b.0);
        Self([
            ay.fma(bz, (-az).fma(by, to.0[0])),
            az.fma(bx, (-ax).fma(bz, to.0[1])),
            ax.fma(by, (-ay).fma(bx, to.0[2])),
        ])
    }

    /// `to` and entry `i` of `self × a` and entry `j` of `self × b`.
    #[inline(always)]
    pub fn cross_entries_add(self, (a, i): (Self, usize), (b, j): (Self, usize), to: L) -> L {
        let [i1, i2, j1, j2] = [(i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3];
        let to = self.0[i1].fma(a.0[i2], (-self.0[i2]).fma(a.0[i1], to));
        self.0[j1].fma(b.0[j2], (-self.0[j2]).fma(b.0[j1], to))
    }
}

impl<L: Lanes> Mat3<L> {
    /// `self·v`.
    #[inline(always)]
    pub fn times(&self, v: Vec3<L>) -> Vec3<L> {
        self.0[0].fma(v.0[0], self.0[1].fma(v.0[1], self.0[2].scale(v.0[2])))
    }

    /// `selfᵀ·v`.
    #[inline(always)]
    pub fn transposed_times(&self, v: Vec3<L>) -> Vec3<L> {
        Vec3([self.0[0].dot(v), self.0[1].dot(v), self.0[2].dot(v)])
    }

    /// `selfᵀ·b`.
    #[inline(always)]
    pub fn transposed_times_matrix(&self, b: &Self) -> Self {
        Self([self.transposed_times(b.0[0]), self.transposed_times(b.0[1]), self.transposed_times(b.0[2])])
    }

    /// `self·b`.
    #[inline(always)]
    pub fn times_matrix(&self, b: &Self) -> Self {
        Self([self.times(b.0[0]), self.times(b.0[1]), self.times(b.0[2])])
    }

    /// Row `row`.
    #[inline(always)]
    pub fn row(&self, row: usize) -> Vec3<L> {
        Vec3([self.0[0].0[row], self.0[1].0[row], self.0[2].0[row]])
    }

    /// `selfᵀ`.
    #[inline(always)]
    pub fn transposed(&self) -> Self {
        Self([self.row(0), self.row(1), self.row(2)])
    }

    /// `selfᵀ·b` where that is known to be symmetric.
    #[inline(always)]
    pub fn transposed_times_symmetric(&self, b: &Self) -> Sym3<L> {
        let ([a0, a1, a2], [b0, b1, b2]) = (self.0, b.0);
        Sym3([a0.dot(b0), a1.dot(b1), a2.dot(b2), a0.dot(b1), a0.dot(b2), a1.dot(b2)])
    }

    /// From memory, column by column.
    #[inline(always)]
    pub fn load(token: L::Token, store: &[[L::Store; 3]; 3]) -> Self {
        Self([Vec3::load(token, &store[0]), Vec3::load(token, &store[1]), Vec3::load(token, &store[2])])
    }

    /// Stores every lane.
    #[inline(always)]
    pub fn store(&self) -> [[L::Store; 3]; 3] {
        [self.0[0].store(), self.0[1].store(), self.0[2].store()]
    }
}

impl<L: Lanes> Mat3<L> {
    /// `self + [v]×`, the matrix of the vector product with `v`.
    #[inline(always)]
    pub fn plus_cross(self, v: Vec3<L>) -> Self {
        let ([x, y, z], [a, b, c]) = (v.0, self.0);
        Self([
            Vec3([a.0[0], a.0[1] + z, a.0[2] - y]),
            Vec3([b.0[0] - z, b.0[1], b.0[2] + x]),
            Vec3([c.0[0] + y, c.0[1] - x, c.0[2]]),
        ])
    }

    /// Adds `a·bᵀ`.
    #[inline(always)]
    pub fn add_outer(self, a: Vec3<L>, b: Vec3<L>) -> Self {
        Self([a.fma(b.0[0], self.0[0]), a.fma(b.0[1], self.0[1]), a.fma(b.0[2], self.0[2])])
    }

    /// `v × column + to`, column by column.
    #[inline(always)]
    pub fn crossed_by_and(&self, v: Vec3<L>, to: &Self) -> Self {
        Self([v.cross_add(self.0[0], to.0[0]), v.cross_add(self.0[1], to.0[1]), v.cross_add(self.0[2], to.0[2])])
    }

    /// The neighbours' matrix: even and odd lanes change places.
    #[inline(always)]
    pub fn swap_halves(self) -> Self {
        Self([self.0[0].swap_halves(), self.0[1].swap_halves(), self.0[2].swap_halves()])
    }
}

impl<L: Lanes> Add for Mat3<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self([self.0[0] + b.0[0], self.0[1] + b.0[1], self.0[2] + b.0[2]])
    }
}

impl<L: Lanes> Add for Sym3<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        let a = self.0;
        Self([a[0] + b.0[0], a[1] + b.0[1], a[2] + b.0[2], a[3] + b.0[3], a[4] + b.0[4], a[5] + b.0[5]])
    }
}

impl<L: Lanes> Sub for Sym3<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        let a = self.0;
        Self([a[0] - b.0[0], a[1] - b.0[1], a[2] - b.0[2], a[3] - b.0[3], a[4] - b.0[4], a[5] - b.0[5]])
    }
}

impl<L: Lanes> Sym3<L> {
    /// The same number in all six.
    #[inline(always)]
    pub fn splat(value: L) -> Self {
        Self([value; 6])
    }

    /// Loads every lane.
    #[inline(always)]
    pub fn load(token: L::Token, store: &[L::Store; 6]) -> Self {
        Self([
            L::load(token, &store[0]),
            L::load(token, &store[1]),
            L::load(token, &store[2]),
            L::load(token, &store[3]),
            L::load(token, &store[4]),
            L::load(token, &store[5]),
        ])
    }

    /// Stores every lane.
    #[inline(always)]
    pub fn store(self) -> [L::Store; 6] {
        [
            self.0[0].store(),
            self.0[1].store(),
            self.0[2].store(),
            self.0[3].store(),
            self.0[4].store(),
            self.0[5].store(),
        ]
    }

    /// Its columns.
    #[inline(always)]
    pub fn columns(&self) -> Mat3<L> {
        let [xx, yy, zz, xy, xz, yz] = self.0;
        Mat3([Vec3([xx, xy, xz]), Vec3([xy, yy, yz]), Vec3([xz, yz, zz])])
    }

    /// `self·v`.
    #[inline(always)]
    pub fn times(&self, v: Vec3<L>) -> Vec3<L> {
        self.columns().times(v)
    }

    /// `self·b`.
    #[inline(always)]
    pub fn times_matrix(&self, b: &Mat3<L>) -> Mat3<L> {
        self.columns().times_matrix(b)
    }

    /// `self − aᵀ·b` where that is known to be symmetric.
    #[inline(always)]
    pub fn minus_transposed_times(self, a: &Mat3<L>, b: &Mat3<L>) -> Self {
        let ([xx, yy, zz, xy, xz, yz], [a0, a1, a2], [b0, b1, b2]) = (self.0, a.0, b.0);
        Self([
            a0.dot_from(b0, xx),
            a1.dot_from(b1, yy),
            a2.dot_from(b2, zz),
            a0.dot_from(b1, xy),
            a0.dot_from(b2, xz),
            a1.dot_from(b2, yz),
        ])
    }

    /// `self + scale·v·vᵀ`.
    #[inline(always)]
    pub fn add_outer(self, scale: L, v: Vec3<L>) -> Self {
        let [x, y, z] = v.0;
        let (sx, sy, sz) = (scale * x, scale * y, scale * z);
        let a = self.0;
        Self([sx.fma(x, a[0]), sy.fma(y, a[1]), sz.fma(z, a[2]), sx.fma(y, a[3]), sx.fma(z, a[4]), sy.fma(z, a[5])])
    }

    /// `self + scale·1`.
    #[inline(always)]
    pub fn add_diagonal(self, scale: L) -> Self {
        let a = self.0;
        Self([a[0] + scale, a[1] + scale, a[2] + scale, a[3], a[4], a[5]])
    }

    /// `scale·self`.
    #[inline(always)]
    pub fn scale(self, scale: L) -> Self {
        let a = self.0;
        Self([a[0] * scale, a[1] * scale, a[2] * scale, a[3] * scale, a[4] * scale, a[5] * scale])
    }

    /// The neighbours' matrix: even and odd lanes change places.
    #[inline(always)]
    pub fn swap_halves(self) -> Self {
        let a = self.0;
        Self([
            a[0].swap_halves(),
            a[1].swap_halves(),
            a[2].swap_halves(),
            a[3].swap_halves(),
            a[4].swap_halves(),
            a[5].swap_halves(),
        ])
    }

    /// `self + a [v]×ᵀ + [v]× bᵀ` where that is known to be symmetric.
    #[inline(always)]
    pub fn add_crossed(self, v: Vec3<L>, a: &Mat3<L>, b: &Mat3<L>) -> Self {
        let [xx, yy, zz, xy, xz, yz] = self.0;
        Self([
            v.cross_entries_add((a.row(0), 0), (b.row(0), 0), xx),
            v.cross_entries_add((a.row(1), 1), (b.row(1), 1), yy),
            v.cross_entries_add((a.row(2), 2), (b.row(2), 2), zz),
            v.cross_entries_add((a.row(0), 1), (b.row(1), 0), xy),
            v.cross_entries_add((a.row(0), 2), (b.row(2), 0), xz),
            v.cross_entries_add((a.row(1), 2), (b.row(2), 1), yz),
        ])
    }

    /// Cholesky's factors without roots: the pivots are quotients of the leading minors, so that no division waits for
    /// another.
    #[inline(always)]
    pub fn factors(&self, one: L) -> Factors<L> {
        let [xx, yy, zz, xy, xz, yz] = self.0;
        let minor = xx.fma(yy, -(xy * xy));
        let (cxz, cyz) = (xy.fma(yz, -(xz * yy)), xy.fma(xz, -(xx * yz)));
        let determinant = xz.fma(cxz, yz.fma(cyz, zz * minor));
        let (over_xx, over_minor) = (one / xx, one / minor);
        Factors {
            below: Vec3([-xy * over_xx, cxz * over_minor, cyz * over_minor]),
            weights: Vec3([over_xx, xx * over_minor, minor / determinant]),
        }
    }

    /// The inverse, by cofactors.
    #[inline(always)]
    pub fn inverse(&self, one: L) -> Self {
        let [xx, yy, zz, xy, xz, yz] = self.0;
        let cxx = yy.fma(zz, -(yz * yz));
        let cyy = xx.fma(zz, -(xz * xz));
        let czz = xx.fma(yy, -(xy * xy));
        let cxy = xz.fma(yz, -(xy * zz));
        let cxz = xy.fma(yz, -(xz * yy));
        let cyz = xy.fma(xz, -(xx * yz));
        let scale = one / xx.fma(cxx, xy.fma(cxy, xz * cxz));
        Self([cxx * scale, cyy * scale, czz * scale, cxy * scale, cxz * scale, cyz * scale])
    }
}

/// Of a symmetric positive matrix `A = L D Lᵀ`, L having ones in its diagonal: `A⁻¹ = Vᵀ W V` with `V = L⁻¹`, `W = D⁻¹`.
#[derive(Clone, Copy)]
pub struct Factors<L> {
    /// V below its diagonal of ones: yx, zx, zy.
    pub below: Vec3<L>,
    /// The diagonal of W.
    pub weights: Vec3<L>,
}

impl<L: Lanes> Factors<L> {
    /// `V·v`.
    #[inline(always)]
    pub fn times(&self, v: Vec3<L>) -> Vec3<L> {
        let ([x, y, z], [yx, zx, zy]) = (v.0, self.below.0);
        Vec3([x, yx.fma(x, y), zy.fma(y, zx.fma(x, z))])
    }

    /// `V·b`.
    #[inline(always)]
    pub fn times_matrix(&self, b: &Mat3<L>) -> Mat3<L> {
        Mat3([self.times(b.0[0]), self.times(b.0[1]), self.times(b.0[2])])
    }

    /// `W·v`.
    #[inline(always)]
    pub fn weighted(&self, v: Vec3<L>) -> Vec3<L> {
        let ([x, y, z], [a, b, c]) = (v.0, self.weights.0);
        Vec3([a * x, b * y, c * z])
    }

    /// `W·b`.
    #[inline(always)]
    pub fn weighted_matrix(&self, b: &Mat3<L>) -> Mat3<L> {
        Mat3([self.weighted(b.0[0]), self.weighted(b.0[1]), self.weighted(b.0[2])])
    }

    /// `Vᵀ·v`, of V what is below its diagonal.
    #[inline(always)]
    pub fn transposed_times(below: Vec3<L>, v: Vec3<L>) -> Vec3<L> {
        let ([x, y, z], [yx, zx, zy]) = (v.0, below.0);
        Vec3([yx.fma(y, zx.fma(z, x)), zy.fma(z, y), z])
    }
}
