// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/sparse_cholesky.h"

#include <cholmod.h>
#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <mutex>
#include <numeric>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

namespace tenter {
namespace {

void callIfLoaded(const char* name, int argument) {
  if (void* function = dlsym(RTLD_DEFAULT, name))
    reinterpret_cast<void (*)(int)>(function)(argument);
}

/// Kernels of a kind of processor that this one has all instructions of; null: no better ones
/// known.
const char* betterKernels() {
#ifdef __x86_64__
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl"))
    return "SkylakeX";
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return "Haswell";
#endif
  return nullptr;
}

/// A release of OpenBLAS takes a processor younger than itself for one of 2004 and computes at a
/// third of its speed. Has it choose again, among the kernels that this processor can run; what the
/// user chose in OPENBLAS_CORETYPE stays. No BLAS call may be under way.
bool chooseKernels() {
  constexpr const char* kChoice = "OPENBLAS_CORETYPE";
  const char* better = betterKernels();
  if (better == nullptr || std::getenv(kChoice) != nullptr) return false;
  const auto name =
      reinterpret_cast<const char* (*)()>(dlsym(RTLD_DEFAULT, "openblas_get_corename"));
  const auto quit = reinterpret_cast<void (*)()>(dlsym(RTLD_DEFAULT, "gotoblas_dynamic_quit"));
  const auto init = reinterpret_cast<void (*)()>(dlsym(RTLD_DEFAULT, "gotoblas_dynamic_init"));
  if (name == nullptr || quit == nullptr || init == nullptr) return false;
  if (std::string_view(name()) != "Prescott") return false;
  setenv(kChoice, better, 1);
  quit();
  init();
  unsetenv(kChoice);
  return true;
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

/// Supernodes of at most so many columns are joined if less than that share of the entries is then
/// zero: more arithmetic in fewer, larger blocks. A sheet of 100 x 100 vertices is factorised a
/// sixth faster than with CHOLMOD's own choice, one of 25 x 25 a third.
constexpr std::array<std::size_t, 3> kJoinedColumns{32, 64, 128};
constexpr std::array<double, 3> kJoinedZeros{0.9, 0.2, 0.1};

/// The matrix is kept in the elimination order that CHOLMOD chose. It would otherwise transpose and
/// permute it before each factorisation, a sixth of the time of the sizes here.
struct SparseCholesky::Impl {
  cholmod_common common{};
  cholmod_sparse matrix{};
  std::vector<int> column_begin, row;  ///< Lower triangle, in elimination order.
  std::vector<double> value;
  std::vector<int> order;     ///< The caller's row at each place of the elimination.
  std::vector<int> target;    ///< Where each of the caller's entries is kept.
  std::vector<int> diagonal;  ///< Where the diagonal entry of each of the caller's rows is kept.
  cholmod_factor* factor = nullptr;
  cholmod_dense* solution = nullptr;
  cholmod_dense* work_y = nullptr;
  cholmod_dense* work_e = nullptr;
  Eigen::MatrixXd ordered;  ///< Right-hand sides in elimination order.

  explicit Impl(const SparseLower& pattern)
      : column_begin(pattern.column_begin), row(pattern.row), value(pattern.row.size(), 0.0) {
    cholmod_start(&common);
    common.print = 0;
    common.final_ll = 1;  // L D L' would accept negative pivots
    common.quick_return_if_not_posdef = 1;
    // Nested dissection: at 100 x 100 vertices 0.56 of the arithmetic of minimum degree.
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_METIS;
    std::ranges::copy(kJoinedColumns, common.nrelax);
    std::ranges::copy(kJoinedZeros, common.zrelax);
    matrix.nrow = matrix.ncol = pattern.size;
    matrix.nzmax = row.size();
    matrix.stype = -1;
    matrix.itype = CHOLMOD_INT;
    matrix.xtype = CHOLMOD_REAL;
    matrix.dtype = CHOLMOD_DOUBLE;
    matrix.sorted = 1;
    matrix.packed = 1;
    {
      // METIS draws from the C library's one generator, which it seeds first: two orderings at once
      // would be of chance, and with them the last bits of all solutions.
      static std::mutex one_at_a_time;
      const std::lock_guard lock(one_at_a_time);
      analyze();
    }
    const int* chosen = static_cast<const int*>(factor->Perm);
    order.assign(chosen, chosen + pattern.size);
    cholmod_free_factor(&factor, &common);
    reorder(pattern);
    common.method[0].ordering = CHOLMOD_NATURAL;
    common.postorder = 0;
    analyze();
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

  void analyze() {
    matrix.p = column_begin.data();
    matrix.i = row.data();
    matrix.x = value.data();
    factor = cholmod_analyze(&matrix, &common);
    if (factor == nullptr)
      throw std::runtime_error("CHOLMOD could not analyse a matrix: out of memory");
  }

  /// Brings the pattern into elimination order.
  void reorder(const SparseLower& pattern) {
    std::vector<int> place(pattern.size);
    for (int k = 0; k < pattern.size; ++k) place[order[k]] = k;
    struct Entry {
      int column, row, source;
    };
    std::vector<Entry> entries;
    entries.reserve(pattern.row.size());
    for (int c = 0; c < pattern.size; ++c)
      for (int k = pattern.column_begin[c]; k < pattern.column_begin[c + 1]; ++k) {
        const auto [low, high] = std::minmax(place[c], place[pattern.row[k]]);
        entries.push_back({low, high, k});
      }
    std::ranges::sort(entries, {}, [](const Entry& e) { return std::pair(e.column, e.row); });
    target.resize(entries.size());
    std::fill(column_begin.begin(), column_begin.end(), 0);
    for (std::size_t k = 0; k < entries.size(); ++k) {
      row[k] = entries[k].row;
      ++column_begin[entries[k].column + 1];
      target[entries[k].source] = static_cast<int>(k);
    }
    std::partial_sum(column_begin.begin(), column_begin.end(), column_begin.begin());
    diagonal.resize(pattern.size);
    for (int c = 0; c < pattern.size; ++c) diagonal[c] = target[pattern.column_begin[c]];
  }
};

SparseCholesky::SparseCholesky(const SparseLower& pattern)
    : impl_(std::make_unique<Impl>(pattern)) {}
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky::~SparseCholesky() = default;

bool SparseCholesky::factorize(const SparseLower& matrix, double shift,
                               const Eigen::VectorXd* weights) {
  useOneThreadInside();
  for (std::size_t k = 0; k < matrix.value.size(); ++k)
    impl_->value[impl_->target[k]] = matrix.value[k];
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
  const std::vector<int>& order = impl_->order;
  Eigen::MatrixXd& ordered = impl_->ordered;
  ordered.resize(rhs.rows(), rhs.cols());
  for (Eigen::Index c = 0; c < rhs.cols(); ++c)
    for (std::size_t k = 0; k < order.size(); ++k)
      ordered(static_cast<Eigen::Index>(k), c) = rhs(order[k], c);
  cholmod_dense b{};
  b.nrow = b.d = rhs.rows();
  b.ncol = rhs.cols();
  b.nzmax = rhs.size();
  b.x = ordered.data();
  b.xtype = CHOLMOD_REAL;
  b.dtype = CHOLMOD_DOUBLE;
  const int ok = cholmod_solve2(CHOLMOD_A, impl_->factor, &b, nullptr, &impl_->solution, nullptr,
                                &impl_->work_y, &impl_->work_e, &impl_->common);
  if (!ok) throw std::runtime_error("CHOLMOD could not solve: out of memory");
  const auto* found = static_cast<const double*>(impl_->solution->x);
  Eigen::MatrixXd x(rhs.rows(), rhs.cols());
  for (Eigen::Index c = 0; c < x.cols(); ++c, found += x.rows())
    for (std::size_t k = 0; k < order.size(); ++k) x(order[k], c) = found[k];
  return x;
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
