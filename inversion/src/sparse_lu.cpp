// SPDX-License-Identifier: GPL-3.0-or-later
#include "sparse_lu.h"

#include <umfpack.h>

#include <array>

namespace tenter {

struct SparseLu::Impl {
  std::array<double, UMFPACK_CONTROL> control{};
  void* symbolic = nullptr;
  void* numeric = nullptr;
  Eigen::SparseMatrix<double> matrix;

  Impl() {
    umfpack_di_defaults(control.data());
    // Rows and columns of one vertex have the same neighbours: pivots may stay on the diagonal, and
    // nested dissection fills a surface's factors least.
    control[UMFPACK_STRATEGY] = UMFPACK_STRATEGY_SYMMETRIC;
    control[UMFPACK_ORDERING] = UMFPACK_ORDERING_METIS;
  }
  ~Impl() {
    umfpack_di_free_numeric(&numeric);
    umfpack_di_free_symbolic(&symbolic);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  bool solve(int system, const Eigen::VectorXd& rhs, Eigen::VectorXd& x) const {
    if (numeric == nullptr) return false;
    x.resize(matrix.cols());
    const int status =
        umfpack_di_solve(system, matrix.outerIndexPtr(), matrix.innerIndexPtr(), matrix.valuePtr(),
                         x.data(), rhs.data(), numeric, control.data(), nullptr);
    return status == UMFPACK_OK && x.allFinite();
  }
};

SparseLu::SparseLu() : impl_(std::make_unique<Impl>()) {}
SparseLu::SparseLu(SparseLu&&) noexcept = default;
SparseLu& SparseLu::operator=(SparseLu&&) noexcept = default;
SparseLu::~SparseLu() = default;

bool SparseLu::factorize(const Eigen::SparseMatrix<double>& matrix) {
  Impl& d = *impl_;
  d.matrix = matrix;
  umfpack_di_free_numeric(&d.numeric);
  const int* begin = d.matrix.outerIndexPtr();
  const int* row = d.matrix.innerIndexPtr();
  if (d.symbolic == nullptr &&
      umfpack_di_symbolic(static_cast<int>(matrix.rows()), static_cast<int>(matrix.cols()), begin,
                          row, d.matrix.valuePtr(), &d.symbolic, d.control.data(),
                          nullptr) != UMFPACK_OK)
    return false;
  const int status = umfpack_di_numeric(begin, row, d.matrix.valuePtr(), d.symbolic, &d.numeric,
                                        d.control.data(), nullptr);
  if (status == UMFPACK_OK) return true;
  umfpack_di_free_numeric(&d.numeric);
  return false;
}

bool SparseLu::solve(const Eigen::VectorXd& rhs, Eigen::VectorXd& x) const {
  return impl_->solve(UMFPACK_A, rhs, x);
}

bool SparseLu::solveTransposed(const Eigen::VectorXd& rhs, Eigen::VectorXd& x) const {
  return impl_->solve(UMFPACK_At, rhs, x);
}

}  // namespace tenter
