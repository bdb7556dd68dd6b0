// SPDX-License-Identifier: GPL-3.0-or-later
#include "normal_factor.h"

#include <cholmod.h>

#include <stdexcept>

namespace tenter {

struct NormalFactor::Impl {
  cholmod_common common{};
  cholmod_factor* factor = nullptr;

  Impl() {
    cholmod_start(&common);
    common.print = 0;
    common.final_ll = 1;
    common.quick_return_if_not_posdef = 1;
  }
  ~Impl() {
    cholmod_free_factor(&factor, &common);
    cholmod_finish(&common);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  static cholmod_sparse view(const Eigen::SparseMatrix<double>& j) {
    cholmod_sparse a{};
    a.nrow = j.rows();
    a.ncol = j.cols();
    a.nzmax = j.nonZeros();
    a.p = const_cast<int*>(j.outerIndexPtr());
    a.i = const_cast<int*>(j.innerIndexPtr());
    a.x = const_cast<double*>(j.valuePtr());
    a.stype = 0;  // J J^T is meant
    a.itype = CHOLMOD_INT;
    a.xtype = CHOLMOD_REAL;
    a.dtype = CHOLMOD_DOUBLE;
    a.sorted = 1;
    a.packed = 1;
    return a;
  }
};

NormalFactor::NormalFactor(const Eigen::SparseMatrix<double>& pattern)
    : impl_(std::make_unique<Impl>()) {
  cholmod_sparse a = Impl::view(pattern);
  impl_->factor = cholmod_analyze(&a, &impl_->common);
  if (impl_->factor == nullptr)
    throw std::runtime_error("CHOLMOD could not analyse a matrix: out of memory");
}
NormalFactor::NormalFactor(NormalFactor&&) noexcept = default;
NormalFactor::~NormalFactor() = default;

bool NormalFactor::factorize(const Eigen::SparseMatrix<double>& j, double shift) {
  cholmod_sparse a = Impl::view(j);
  double beta[2] = {shift, 0.0};
  cholmod_factorize_p(&a, beta, nullptr, 0, impl_->factor, &impl_->common);
  return impl_->common.status == CHOLMOD_OK && impl_->factor->minor == impl_->factor->n;
}

Eigen::MatrixXd NormalFactor::solve(const Eigen::MatrixXd& rhs) {
  cholmod_dense b{};
  b.nrow = b.d = rhs.rows();
  b.ncol = rhs.cols();
  b.nzmax = rhs.size();
  b.x = const_cast<double*>(rhs.data());
  b.xtype = CHOLMOD_REAL;
  b.dtype = CHOLMOD_DOUBLE;
  cholmod_dense* x = cholmod_solve(CHOLMOD_A, impl_->factor, &b, &impl_->common);
  if (x == nullptr) throw std::runtime_error("CHOLMOD could not solve: out of memory");
  Eigen::MatrixXd out =
      Eigen::Map<const Eigen::MatrixXd>(static_cast<const double*>(x->x), rhs.rows(), rhs.cols());
  cholmod_free_dense(&x, &impl_->common);
  return out;
}

}  // namespace tenter
