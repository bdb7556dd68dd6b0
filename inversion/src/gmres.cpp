// SPDX-License-Identifier: GPL-3.0-or-later
#include "gmres.h"

#include <Eigen/QR>
#include <algorithm>

namespace tenter {

Eigen::VectorXd solveGmres(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& product,
                           const Eigen::VectorXd& b, int max_products, double tolerance) {
  const double size = b.norm();
  const int most = std::min(max_products, static_cast<int>(b.size()));
  if (!(size > 0.0) || most == 0) return Eigen::VectorXd::Zero(b.size());
  Eigen::MatrixXd basis(b.size(), most + 1), h = Eigen::MatrixXd::Zero(most + 1, most);
  Eigen::VectorXd target = Eigen::VectorXd::Zero(most + 1), y;
  basis.col(0) = b / size;
  target[0] = size;
  int k = 0;
  while (k < most) {
    Eigen::VectorXd next = product(basis.col(k));
    for (int pass = 0; pass < 2; ++pass) {  // once is not orthogonal enough
      const Eigen::VectorXd part = basis.leftCols(k + 1).transpose() * next;
      next -= basis.leftCols(k + 1) * part;
      h.col(k).head(k + 1) += part;
    }
    h(k + 1, k) = next.norm();
    const bool complete = !(h(k + 1, k) > 0.0);
    if (!complete) basis.col(k + 1) = next / h(k + 1, k);
    ++k;
    const auto hessenberg = h.topLeftCorner(k + 1, k);
    y = hessenberg.colPivHouseholderQr().solve(target.head(k + 1));
    if (complete || (hessenberg * y - target.head(k + 1)).norm() <= tolerance * size) break;
  }
  return basis.leftCols(k) * y;
}

}  // namespace tenter
