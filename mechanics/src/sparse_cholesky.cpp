// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/sparse_cholesky.h"

#include <cholmod.h>
#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <stdexcept>
#include <string_view>

namespace tenter {
namespace {

void callIfLoaded(const char* name, int argument) {
  if (void* function = dlsym(RTLD_DEFAULT, name))
    reinterpret_cast<void (*)(int)>(function)(argument);
}

/// A release of OpenBLAS takes a processor younger than itself for one of 2004 and computes at a
/// third of its speed. Has it choose again, with Haswell's kernels, where AVX2 is there; what the
/// user chose in OPENBLAS_CORETYPE stays. No BLAS call may be under way.
bool chooseKernels() {
#ifdef __x86_64__
  __builtin_cpu_init();
  constexpr const char* kChoice = "OPENBLAS_CORETYPE";
  const bool able = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (!able || std::getenv(kChoice) != nullptr) return false;
  const auto name =
      reinterpret_cast<const char* (*)()>(dlsym(RTLD_DEFAULT, "openblas_get_corename"));
  const auto quit = reinterpret_cast<void (*)()>(dlsym(RTLD_DEFAULT, "gotoblas_dynamic_quit"));
  const auto init = reinterpret_cast<void (*)()>(dlsym(RTLD_DEFAULT, "gotoblas_dynamic_init"));
  if (name == nullptr || quit == nullptr || init == nullptr) return false;
  if (std::string_view(name()) != "Prescott") return false;
  setenv(kChoice, "Haswell", 1);
  quit();
  init();
  unsetenv(kChoice);
  return true;
#else
  return false;
#endif
}

/// Before main, while there is but one thread.
[[maybe_unused]] const bool kKernelsChosen = chooseKernels();

/// Supernodes here are so small that a second thread inside BLAS (OpenBLAS) or CHOLMOD (OpenMP)
/// costs many times what it saves. Which BLAS is loaded is known only when the program runs.
void useOneThreadInside() {
  static const bool blas = [] {
    callIfLoaded("openblas_set_num_threads", 1);
    return true;
  }();
  static thread_local const bool regions = [] {
    callIfLoaded("omp_set_max_active_levels", 0);
    return true;
  }();
  static_cast<void>(blas);
  static_cast<void>(regions);
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
  useOneThreadInside();
  std::copy(matrix.value.begin(), matrix.value.end(), impl_->value.begin());
  if (shift != 0.0) {
    for (int c = 0; c < matrix.size; ++c)
      impl_->value[impl_->diagonal[c]] += weights ? shift * (*weights)[c] : shift;
  }
  cholmod_factorize(&impl_->matrix, impl_->factor, &impl_->common);
  return impl_->common.status == CHOLMOD_OK && impl_->factor->minor == impl_->factor->n;
}

void SparseCholesky::solve(const Eigen::VectorXd& rhs, Eigen::VectorXd& x) {
  x = solve(Eigen::MatrixXd(rhs));
}

Eigen::MatrixXd SparseCholesky::solve(const Eigen::MatrixXd& rhs) {
  useOneThreadInside();
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
