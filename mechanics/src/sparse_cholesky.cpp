// SPDX-License-Identifier: GPL-3.0-or-later
#include "sparse_cholesky.h"

#include <cholmod.h>

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <stdexcept>

// Provided by OpenBLAS; absent with another BLAS.
extern "C" void openblas_set_num_threads(int count) __attribute__((weak));

namespace tenter {
namespace {

/// Supernodes here are so small that a second BLAS thread costs many times what it saves.
void useOneBlasThread() {
  static const bool done = [] {
    if (openblas_set_num_threads) openblas_set_num_threads(1);
    return true;
  }();
  static_cast<void>(done);
}

}  // namespace

struct SparseCholesky::Impl {
  cholmod_common common{};
  cholmod_sparse matrix{};
  std::vector<int> column_begin, row;
  std::vector<double> value;
  std::vector<int> diagonal;  ///< Position of each diagonal entry.
  cholmod_factor* factor = nullptr;
  cholmod_dense* solution = nullptr;
  cholmod_dense* work_y = nullptr;
  cholmod_dense* work_e = nullptr;

  explicit Impl(const SparseLower& pattern)
      : column_begin(pattern.column_begin), row(pattern.row), value(pattern.row.size(), 0.0) {
    useOneBlasThread();
    cholmod_start(&common);
    common.print = 0;
    common.final_ll = 1;  // L D L' would accept negative pivots
    common.quick_return_if_not_posdef = 1;
    matrix.nrow = matrix.ncol = pattern.size;
    matrix.nzmax = row.size();
    matrix.p = column_begin.data();
    matrix.i = row.data();
    matrix.x = value.data();
    matrix.stype = -1;
    matrix.itype = CHOLMOD_INT;
    matrix.xtype = CHOLMOD_REAL;
    matrix.dtype = CHOLMOD_DOUBLE;
    matrix.sorted = 1;
    matrix.packed = 1;
    for (int c = 0; c < pattern.size; ++c) diagonal.push_back(column_begin[c]);
    factor = cholmod_analyze(&matrix, &common);
    if (factor == nullptr)
      throw std::runtime_error("CHOLMOD could not analyse a matrix: out of memory");
  }
  ~Impl() {
    cholmod_free_dense(&solution, &common);
    cholmod_free_dense(&work_y, &common);
    cholmod_free_dense(&work_e, &common);
    cholmod_free_factor(&factor, &common);
    cholmod_finish(&common);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
};

SparseCholesky::SparseCholesky(const SparseLower& pattern)
    : impl_(std::make_unique<Impl>(pattern)) {}
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky::~SparseCholesky() = default;

bool SparseCholesky::factorize(const SparseLower& matrix, double shift,
                               const Eigen::VectorXd* weights) {
  std::copy(matrix.value.begin(), matrix.value.end(), impl_->value.begin());
  if (shift != 0.0) {
    for (int c = 0; c < matrix.size; ++c) impl_->value[impl_->diagonal[c]] += shift * (*weights)[c];
  }
  cholmod_factorize(&impl_->matrix, impl_->factor, &impl_->common);
  return impl_->common.status == CHOLMOD_OK && impl_->factor->minor == impl_->factor->n;
}

void SparseCholesky::solve(const Eigen::VectorXd& rhs, Eigen::VectorXd& x) {
  x = solve(Eigen::MatrixXd(rhs));
}

Eigen::MatrixXd SparseCholesky::solve(const Eigen::MatrixXd& rhs) {
  cholmod_dense b{};
  b.nrow = b.d = rhs.rows();
  b.ncol = rhs.cols();
  b.nzmax = rhs.size();
  b.x = const_cast<double*>(rhs.data());
  b.xtype = CHOLMOD_REAL;
  b.dtype = CHOLMOD_DOUBLE;
  const int ok = cholmod_solve2(CHOLMOD_A, impl_->factor, &b, nullptr, &impl_->solution, nullptr,
                                &impl_->work_y, &impl_->work_e, &impl_->common);
  if (!ok) throw std::runtime_error("CHOLMOD could not solve: out of memory");
  return Eigen::Map<const Eigen::MatrixXd>(static_cast<const double*>(impl_->solution->x),
                                           rhs.rows(), rhs.cols());
}

Eigen::VectorXd SparseCholesky::negativeDirection(const SparseLower& m) {
  using Sparse = Eigen::SparseMatrix<double>;
  const Eigen::Map<const Sparse> lower(m.size, m.size, static_cast<int>(m.value.size()),
                                       m.column_begin.data(), m.row.data(), m.value.data());
  // Without pivoting, L D L' of an indefinite matrix exists but for zero pivots; a negative pivot j
  // gives v = L^-T e_j with v' H v = d_j < 0.
  Eigen::SimplicialLDLT<Sparse, Eigen::Lower> ldlt;
  ldlt.compute(lower);
  if (ldlt.info() != Eigen::Success) return {};
  Eigen::Index j = 0;
  const Eigen::VectorXd d = ldlt.vectorD();
  if (!(d.minCoeff(&j) < 0.0)) return {};
  Eigen::VectorXd v = Eigen::VectorXd::Unit(m.size, j);
  v = ldlt.matrixU().solve(v).eval();
  return ldlt.permutationPinv() * v;
}

void multiply(const SparseLower& h, const Eigen::VectorXd& x, Eigen::VectorXd& y) {
  y.setZero(h.size);
  for (int c = 0; c < h.size; ++c) {
    double sum = 0.0;
    for (int k = h.column_begin[c]; k < h.column_begin[c + 1]; ++k) {
      const int r = h.row[k];
      if (r == c) {
        y[c] += h.value[k] * x[c];
      } else {
        y[r] += h.value[k] * x[c];
        sum += h.value[k] * x[r];
      }
    }
    y[c] += sum;
  }
}

}  // namespace tenter
