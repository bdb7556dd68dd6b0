// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit_statistics.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "outer_solver.h"

namespace tenter {
namespace {

/// Closer to its bound than this (in units of the group's typical stiffness) an entry rests on it.
constexpr double kAtBound = 1e-9;
/// A knot's relative error refers to at least this share of the curve's largest stiffness.
constexpr double kSmallKnot = 0.05;
/// A test is cut into at most so many runs of consecutive frames, whose misfits count as
/// independent.
constexpr int kRuns = 10;
/// Misfit per degree of freedom beyond which the law and not noise is what is missed.
constexpr double kMissedByLaw = 1.5;
/// A run that says nearly all there is about something has nothing left to disagree with.
constexpr double kLeastLeft = 0.05;
/// Terms of a combination lighter than this are not listed.
constexpr double kLightTerm = 0.1;

/// Keeps the equations of z regular where no data speak.
Eigen::MatrixXd vagueInformation(int size) {
  return Eigen::MatrixXd::Identity(size, size) / (kVagueRelativeStd * kVagueRelativeStd);
}

std::vector<TestInformation> gather(const FrameEvaluator& evaluator,
                                    const std::vector<FitBlock>& blocks) {
  const FitSpace& space = evaluator.space();
  const int n = space.size();
  std::vector<TestInformation> tests(evaluator.tests().size());
  for (TestInformation& test : tests) test.own = Eigen::VectorXd::Zero(n);
  for (const FitBlock& block : blocks)
    for (const int t : block.tests)
      for (const int g : block.groups)
        if (space.offset(g) >= 0)
          tests[t].own.segment(space.offset(g), space.state().groups[g].basis->size()).setOnes();
  for (std::size_t t = 0; t < tests.size(); ++t) {
    tests[t].normal = Eigen::MatrixXd::Zero(n, n);
    tests[t].gradient = Eigen::VectorXd::Zero(n);
    tests[t].residuals = evaluator.rawResidualCount(static_cast<int>(t));
  }
  std::vector<int> frames(tests.size(), 0), seen(tests.size(), 0);
  for (const FrameId& id : evaluator.frames()) ++frames[id.test];
  for (std::size_t t = 0; t < tests.size(); ++t)
    tests[t].runs.assign(std::min(kRuns, frames[t]),
                         {Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)});
  for (std::size_t i = 0; i < evaluator.frames().size(); ++i) {
    const FrameBlock& block = evaluator.blocks()[i];
    const int t = evaluator.frames()[i].test;
    TestInformation& test = tests[t];
    TestInformation::Run& run =
        test.runs[seen[t]++ * static_cast<int>(test.runs.size()) / frames[t]];
    run.normal.noalias() += block.jacobian.transpose() * block.jacobian;
    run.gradient.noalias() += block.jacobian.transpose() * block.residuals;
    test.chi2 += block.residuals.squaredNorm();
  }
  for (TestInformation& test : tests)
    for (const TestInformation::Run& run : test.runs) {
      test.normal += run.normal;
      test.gradient += run.gradient;
    }
  return tests;
}

/// 97.5 % quantile of Student's t over that of the normal distribution (the first terms in 1 /
/// freedom): what a variance from few runs falls short of, so that 1.96 of its root still hold 95
/// %.
double fewRunsFactor(double freedom) {
  constexpr double kNormal = 1.96, kFirst = 2.37, kSecond = 2.82;
  return (kNormal + kFirst / freedom + kSecond / (freedom * freedom)) / kNormal;
}

/// What runs of frames disagree about: the middle of the sandwich for clustered errors [LZ86]. A
/// run draws the optimum towards itself, the more the more it says: in coordinates where all tests'
/// information is the identity, dividing by the root of I - (its own information) undoes that
/// [BM02].
Eigen::MatrixXd disagreement(const TestInformation& test, const Eigen::MatrixXd& information) {
  const Eigen::LLT<Eigen::MatrixXd> factor(information);
  const auto n = information.rows();
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(n, n);
  if (test.runs.size() < 2) return sum;
  for (const TestInformation::Run& run : test.runs) {
    const Eigen::MatrixXd own = test.own.asDiagonal() * run.normal * test.own.asDiagonal();
    const Eigen::MatrixXd half = factor.matrixL().solve(own);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> share(
        factor.matrixL().solve(half.transpose()));
    const Eigen::VectorXd left = (1.0 - share.eigenvalues().array()).max(kLeastLeft);
    const Eigen::VectorXd gradient = test.own.cwiseProduct(run.gradient);
    const Eigen::VectorXd seen =
        share.eigenvectors().transpose() * factor.matrixL().solve(gradient);
    const Eigen::VectorXd undone =
        factor.matrixL() * (share.eigenvectors() * seen.cwiseQuotient(left.cwiseSqrt()));
    sum += undone * undone.transpose();
  }
  const double widened = fewRunsFactor(static_cast<double>(test.runs.size() - 1));
  return widened * widened * sum;
}

/// What the fit of each block knew besides its data (outer_solver.h).
struct Belief {
  Eigen::MatrixXd information;  ///< In the equations, as the fit weighed it.
  Eigen::MatrixXd noise;        ///< In the middle of the sandwich, as misfit widens the data's.
};

Belief beliefOf(const FitSpace& space, const std::vector<FitBlock>& blocks,
                const std::vector<TestInformation>& tests) {
  const int n = space.size();
  Belief belief{Eigen::MatrixXd::Zero(n, n), Eigen::MatrixXd::Zero(n, n)};
  for (const FitBlock& block : blocks) {
    double chi2 = 0.0, residuals = 0.0;
    for (const int t : block.tests) {
      chi2 += tests[t].chi2;
      residuals += tests[t].residuals;
    }
    std::vector<int> groups;
    for (const int g : block.groups)
      if (space.offset(g) >= 0) groups.push_back(g);
    const FitSpace own(space.state(), groups);
    const double misfit = chi2 / std::max(1.0, residuals);
    const Prior prior = weakPrior(own, misfit);
    const Eigen::MatrixXd information = prior.matrix.transpose() * prior.matrix;
    for (const int g : groups) {
      const int count = space.state().groups[g].basis->size();
      const auto part = information.block(own.offset(g), own.offset(g), count, count);
      belief.information.block(space.offset(g), space.offset(g), count, count) = part;
      belief.noise.block(space.offset(g), space.offset(g), count, count) =
          std::max(1.0, misfit) * part;
    }
  }
  return belief;
}

std::vector<bool> entriesAtBound(const FitSpace& space, const Eigen::VectorXd& z) {
  const Eigen::VectorXd lower = space.lowerBounds();
  std::vector<bool> at_bound(z.size());
  for (int i = 0; i < z.size(); ++i) at_bound[i] = z[i] - lower[i] <= kAtBound;
  return at_bound;
}

/// Inverse on the entries that are free; rows and columns of held ones are zero. Entries differ by
/// many decades in how well they are known, so the matrix is scaled first.
Eigen::MatrixXd inverseOfFree(Eigen::MatrixXd equations, const std::vector<bool>& held) {
  const auto n = equations.rows();
  for (Eigen::Index i = 0; i < n; ++i)
    if (held[i]) {
      equations.row(i).setZero();
      equations.col(i).setZero();
      equations(i, i) = 1.0;
    }
  const Eigen::VectorXd scale = equations.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * equations * scale.asDiagonal();
  Eigen::MatrixXd inverse = scale.asDiagonal() * scaled.fullPivLu().inverse() * scale.asDiagonal();
  for (Eigen::Index i = 0; i < n; ++i)
    if (held[i]) inverse(i, i) = 0.0;
  return inverse;
}

/// inverse * noise * inverse^T through a root of the noise: rounding then cannot make a variance
/// negative, however unevenly the entries are known.
Eigen::MatrixXd covarianceOf(const Eigen::MatrixXd& inverse, const Eigen::MatrixXd& noise) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(0.5 * (noise + noise.transpose()));
  const Eigen::MatrixXd root =
      inverse * eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  return root * root.transpose();
}

/// Covariance of z. What rests on its bound holds still for the others, but is itself no better
/// known for it.
Eigen::MatrixXd sandwich(const Eigen::MatrixXd& equations, const Eigen::MatrixXd& noise,
                         const std::vector<bool>& at_bound) {
  Eigen::MatrixXd covariance = covarianceOf(inverseOfFree(equations, at_bound), noise);
  const std::vector<bool> none(at_bound.size(), false);
  if (at_bound == none) return covariance;
  const Eigen::MatrixXd all = covarianceOf(inverseOfFree(equations, none), noise);
  for (Eigen::Index i = 0; i < all.rows(); ++i)
    if (at_bound[i]) covariance(i, i) = all(i, i);
  return covariance;
}

}  // namespace

FitStatistics fitStatistics(const FrameEvaluator& evaluator, const std::vector<FitBlock>& blocks,
                            const Eigen::VectorXd& z) {
  FitStatistics statistics;
  statistics.tests = gather(evaluator, blocks);
  statistics.at_bound = entriesAtBound(evaluator.space(), z);
  Eigen::MatrixXd equations = vagueInformation(evaluator.space().size());
  Eigen::MatrixXd noise = equations;
  Eigen::MatrixXd information = equations;
  for (const TestInformation& test : statistics.tests) {
    equations += test.equations();
    information += test.equations() * test.own.asDiagonal();
  }
  const Eigen::MatrixXd inverse = inverseOfFree(equations, statistics.at_bound);

  for (std::size_t t = 0; t < statistics.tests.size(); ++t) {
    TestInformation& test = statistics.tests[t];
    const double taken = (inverse * test.equations()).trace();
    test.chi2_per_dof = test.chi2 / std::max(1.0, test.residuals - taken);
    noise += std::max(1.0, test.chi2_per_dof) * test.equations() * test.own.asDiagonal();
    const bool by_law = evaluator.tests()[t]->discrepancy_m() > 0.0;
    if (by_law || test.chi2_per_dof > kMissedByLaw) noise += disagreement(test, information);
  }
  statistics.data_covariance = sandwich(equations, noise, statistics.at_bound);
  const Belief belief = beliefOf(evaluator.space(), blocks, statistics.tests);
  statistics.covariance =
      sandwich(equations + belief.information, noise + belief.noise, statistics.at_bound);
  return statistics;
}

KnotStatistics knotStatistics(const FitSpace& space, const Eigen::VectorXd& z,
                              const Eigen::MatrixXd& covariance,
                              const Eigen::MatrixXd& data_covariance, int group) {
  const ParameterGroup& g = space.state().groups[group];
  const Eigen::MatrixXd map = g.reference * g.basis->knotValueMap();
  const int begin = space.offset(group), count = g.basis->size();
  KnotStatistics knots;
  knots.value = map * z.segment(begin, count);
  const auto stdBy = [&](const Eigen::MatrixXd& of_z) -> Eigen::VectorXd {
    return (map * of_z.block(begin, begin, count, count) * map.transpose())
        .diagonal()
        .cwiseMax(0.0)
        .cwiseSqrt();
  };
  knots.std = stdBy(covariance);
  const Eigen::VectorXd by_data = stdBy(data_covariance);
  double floor = kSmallKnot * knots.value.cwiseAbs().maxCoeff();
  // A coupling may well be 0: its error refers to what would matter.
  if (g.may_be_negative) floor = std::max(floor, g.reference);
  for (int i = 0; i < knots.value.size(); ++i)
    knots.observed.push_back(by_data[i] <=
                             kSeenRelativeStd * std::max(floor, std::abs(knots.value[i])));
  return knots;
}

nlohmann::json identifiabilityJson(const FitSpace& space, const FitStatistics& statistics) {
  nlohmann::json json = {{"seen_relative_std", kSeenRelativeStd},
                         {"scale", "coefficients relative to their curve's mean stiffness"},
                         {"combinations", nlohmann::json::array()},
                         {"at_bound", nlohmann::json::array()}};
  std::vector<std::string> names;
  std::vector<int> coefficients;
  for (const int g : space.groups())
    for (int j = 0; j < space.state().groups[g].basis->size(); ++j) {
      names.push_back(space.state().groupName(g));
      coefficients.push_back(j);
    }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(statistics.data_covariance);
  for (int i = 0; i < space.size(); ++i) {
    const Eigen::VectorXd direction = eigen.eigenvectors().col(i);
    const double relative_std = std::sqrt(std::max(0.0, eigen.eigenvalues()[i]));
    nlohmann::json terms = nlohmann::json::array();
    bool held = false;
    for (int j = 0; j < space.size(); ++j) {
      if (std::abs(direction[j]) < kLightTerm) continue;
      held = held || statistics.at_bound[j];
      terms.push_back(
          {{"component", names[j]}, {"coefficient", coefficients[j]}, {"weight", direction[j]}});
    }
    if (held && relative_std == 0.0) continue;
    json["combinations"].push_back({{"relative_std", relative_std},
                                    {"seen", relative_std <= kSeenRelativeStd},
                                    {"terms", terms}});
  }
  for (int j = 0; j < space.size(); ++j)
    if (statistics.at_bound[j])
      json["at_bound"].push_back({{"component", names[j]}, {"coefficient", coefficients[j]}});
  return json;
}

namespace {

struct Specimen {
  std::string name;
  Eigen::VectorXd z;
  Eigen::MatrixXd covariance;
};

/// Gauss-Newton from the common optimum with the specimen's own tests.
std::vector<Specimen> specimenSteps(const FrameEvaluator& evaluator,
                                    const FitStatistics& statistics, const Eigen::VectorXd& z) {
  std::vector<std::string> names;
  for (const FitTest* test : evaluator.tests()) names.push_back(test->measurement().specimen);
  std::vector<std::string> unique = names;
  std::ranges::sort(unique);
  unique.erase(std::unique(unique.begin(), unique.end()), unique.end());
  const Eigen::VectorXd lower = evaluator.space().lowerBounds();
  std::vector<Specimen> specimens;
  for (const std::string& name : unique) {
    Eigen::MatrixXd equations = vagueInformation(evaluator.space().size()), noise = equations;
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(z.size());
    for (std::size_t t = 0; t < names.size(); ++t) {
      if (names[t] != name) continue;
      const TestInformation& test = statistics.tests[t];
      const double weight = 1.0 / std::max(1.0, test.chi2_per_dof);
      equations += weight * test.equations();
      noise += weight * test.equations() * test.own.asDiagonal();
      gradient += weight * test.own.cwiseProduct(test.gradient);
    }
    const Eigen::MatrixXd inverse = inverseOfFree(equations, statistics.at_bound);
    Specimen specimen{name, (z - inverse * gradient).cwiseMax(lower), covarianceOf(inverse, noise)};
    specimens.push_back(std::move(specimen));
  }
  return specimens;
}

nlohmann::json scatterOfGroup(const FitSpace& space, const std::vector<Specimen>& specimens,
                              int group) {
  std::vector<KnotStatistics> each;
  for (const Specimen& s : specimens)
    each.push_back(knotStatistics(space, s.z, s.covariance, s.covariance, group));
  const std::vector<double>& strains = space.state().groups[group].basis->knots();
  nlohmann::json knots = nlohmann::json::array();
  for (std::size_t k = 0; k < strains.size(); ++k) {
    nlohmann::json values = nlohmann::json::array();
    double sum = 0.0, squares = 0.0;
    int count = 0;
    for (std::size_t s = 0; s < specimens.size(); ++s) {
      const double value = each[s].value[static_cast<int>(k)];
      if (!each[s].observed[k]) continue;
      values.push_back({{"specimen", specimens[s].name},
                        {"stiffness", value},
                        {"std", each[s].std[static_cast<int>(k)]}});
      sum += value;
      squares += value * value;
      ++count;
    }
    const double spread =
        count < 2 ? 0.0 : std::max(0.0, squares - sum * sum / count) / (count - 1);
    knots.push_back({{"strain", strains[k]},
                     {"scatter", count < 2 ? nlohmann::json() : nlohmann::json(std::sqrt(spread))},
                     {"values", values}});
  }
  return {{"component", space.state().groupName(group)}, {"knots", knots}};
}

}  // namespace

nlohmann::json specimenJson(const FrameEvaluator& evaluator, const FitStatistics& statistics,
                            const Eigen::VectorXd& z) {
  const std::vector<Specimen> specimens = specimenSteps(evaluator, statistics, z);
  if (specimens.size() < 2) return nullptr;
  nlohmann::json json = {{"method", "one Gauss-Newton step a specimen from the common optimum"},
                         {"names", nlohmann::json::array()},
                         {"curves", nlohmann::json::array()}};
  for (const Specimen& s : specimens) json["names"].push_back(s.name);
  for (const int g : evaluator.space().groups())
    json["curves"].push_back(scatterOfGroup(evaluator.space(), specimens, g));
  return json;
}

}  // namespace tenter
