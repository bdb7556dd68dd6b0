// SPDX-License-Identifier: GPL-3.0-or-later
#include "hessian_assembler.h"

#include <algorithm>

namespace tenter {
namespace {

void sortUnique(std::vector<int>& v) {
  std::sort(v.begin(), v.end());
  v.erase(std::unique(v.begin(), v.end()), v.end());
}

}  // namespace

/// Receives one term's elements in order and scatters them.
class HessianAssembler::Sink final : public HessianSink {
 public:
  Sink(HessianAssembler& owner, std::size_t term, const Eigen::VectorXd& q,
       const ClipFrames& frames)
      : owner_(owner), term_(term), q_(q), frames_(frames) {}

  void add(int element, const double* block) override {
    const ElementPlan& plan = owner_.plans_[term_][element];
    if (plan.transform >= 0) block = transformed(owner_.transforms_[plan.transform], block);
    scatter(block, plan.free_begin, plan.free_end, owner_.matrix_.value.data());
    scatter(block, plan.held_begin, plan.held_end, owner_.held_.valuePtr());
  }

 private:
  static constexpr int kMaxSize = 3 * Stencil::kMaxNodes + Stencil::kMaxScalars;
  static constexpr int kMaxLocal = 6 * Stencil::kMaxNodes + Stencil::kMaxScalars;
  using Block = Eigen::Map<const Eigen::MatrixXd>;

  void scatter(const double* block, int begin, int end, double* values) const {
    for (int k = begin; k < end; ++k) {
      const Run& run = owner_.runs_[k];
      for (int i = 0; i < run.length; ++i) values[run.target + i] += block[run.source + i];
    }
  }

  const double* transformed(const Transform& t, const double* block) {
    const int n = t.stencil.size();
    jacobian_.topLeftCorner(n, t.size).setZero();
    for (int k = 0; k < t.stencil.node_count; ++k) {
      if (t.node_clip[k] < 0) {
        jacobian_.block<3, 3>(3 * k, t.node_local[k]).setIdentity();
      } else {
        const Vec3 arm = q_.segment<3>(3 * t.stencil.nodes[k]) - frames_.pivot[t.node_clip[k]];
        jacobian_.block<3, 6>(3 * k, t.node_local[k]) =
            clipJacobian(arm, frames_.rotation_scale_m[t.node_clip[k]]);
      }
    }
    for (int k = 0; k < t.stencil.scalar_count; ++k) {
      jacobian_(3 * t.stencil.node_count + k, t.scalar_local[k]) = 1.0;
    }
    const auto j = jacobian_.topLeftCorner(n, t.size);
    product_.topLeftCorner(n, t.size).noalias() = Block(block, n, n).lazyProduct(j);
    Eigen::Map<Eigen::MatrixXd> out(local_.data(), t.size, t.size);
    out.noalias() = j.transpose().lazyProduct(product_.topLeftCorner(n, t.size));
    return local_.data();
  }

  HessianAssembler& owner_;
  std::size_t term_;
  const Eigen::VectorXd& q_;
  const ClipFrames& frames_;
  Eigen::Matrix<double, kMaxSize, kMaxLocal> jacobian_;
  Eigen::Matrix<double, kMaxSize, kMaxLocal> product_;
  std::array<double, kMaxLocal * kMaxLocal> local_;
};

HessianAssembler::HessianAssembler(const DofMap& map,
                                   const std::vector<std::unique_ptr<EnergyTerm>>& terms)
    : map_(map), terms_(terms), plans_(terms.size()) {
  std::vector<std::vector<int>> free_rows(map.dof_count), held_columns(map.heldCount());
  for (int d = 0; d < map.dof_count; ++d) free_rows[d].push_back(d);
  for (int c : map.clip_dof) {
    for (int a = 0; c >= 0 && a < 6; ++a) {
      for (int b = a; b < 6; ++b) free_rows[c + a].push_back(c + b);
    }
  }
  for (const auto& term : terms) {
    for (const Stencil& s : term->stencils())
      collectPattern(entitiesOf(s, nullptr), free_rows, held_columns);
  }

  matrix_.size = map.dof_count;
  matrix_.column_begin.assign(1, 0);
  for (auto& rows : free_rows) {
    sortUnique(rows);
    matrix_.row.insert(matrix_.row.end(), rows.begin(), rows.end());
    matrix_.column_begin.push_back(static_cast<int>(matrix_.row.size()));
  }
  matrix_.value.assign(matrix_.row.size(), 0.0);

  held_.resize(map.heldCount(), map.dof_count + map.heldCount());
  std::vector<int> counts(map.heldCount());
  for (int r = 0; r < map.heldCount(); ++r) {
    sortUnique(held_columns[r]);
    counts[r] = static_cast<int>(held_columns[r].size());
  }
  held_.reserve(counts);
  for (int r = 0; r < map.heldCount(); ++r) {
    for (int c : held_columns[r]) held_.insert(r, c) = 0.0;
  }
  held_.makeCompressed();

  for (std::size_t t = 0; t < terms.size(); ++t) {
    for (const Stencil& s : terms[t]->stencils()) {
      ElementPlan plan{};
      plan.transform = -1;
      Transform transform;
      const auto entities = entitiesOf(s, &transform);
      int local_size = s.size();
      if (transform.size > 0) {
        plan.transform = static_cast<int>(transforms_.size());
        local_size = transform.size;
        transforms_.push_back(std::move(transform));
      }
      planElement(entities, local_size, plan);
      plans_[t].push_back(plan);
    }
  }
}

std::vector<HessianAssembler::Entity> HessianAssembler::entitiesOf(const Stencil& s,
                                                                   Transform* transform) const {
  const bool on_clip = std::any_of(s.nodes.begin(), s.nodes.begin() + s.node_count,
                                   [&](int n) { return map_.onFreeClip(n); });
  std::vector<Entity> entities;
  Transform t;
  t.stencil = s;
  int local = 0;
  std::vector<std::pair<int, int>> clips;  // clip, first local row
  for (int k = 0; k < s.node_count; ++k) {
    const int node = s.nodes[k];
    if (on_clip && map_.onFreeClip(node)) {
      const int clip = map_.node_clip[node];
      auto known =
          std::find_if(clips.begin(), clips.end(), [&](auto& c) { return c.first == clip; });
      if (known == clips.end()) {
        entities.push_back({map_.clip_dof[clip], -1, 6, local});
        known = clips.insert(clips.end(), {clip, local});
        local += 6;
      }
      t.node_local.push_back(known->second);
      t.node_clip.push_back(clip);
      continue;
    }
    const bool held = map_.node_dof[node] < 0;
    entities.push_back({held ? -1 : map_.node_dof[node], held ? map_.node_held[node] : -1,
                        held ? 3 : map_.dofs_per_node, local});
    t.node_local.push_back(local);
    t.node_clip.push_back(-1);
    local += 3;
  }
  for (int k = 0; k < s.scalar_count; ++k) {
    entities.push_back({map_.rotation_dof + s.scalars[k] - 3 * map_.node_count, -1, 1, local});
    t.scalar_local.push_back(local++);
  }
  t.size = local;
  if (transform && on_clip) *transform = std::move(t);
  return entities;
}

void HessianAssembler::collectPattern(const std::vector<Entity>& entities,
                                      std::vector<std::vector<int>>& free_rows,
                                      std::vector<std::vector<int>>& held_columns) const {
  for (const Entity& a : entities) {
    for (const Entity& b : entities) {
      for (int i = 0; i < a.size; ++i) {
        for (int j = 0; j < b.size; ++j) {
          if (a.first_held >= 0) {
            const int column = b.first_held >= 0 ? map_.dof_count + b.first_held : b.first_dof;
            held_columns[a.first_held + i].push_back(column + j);
          } else if (b.first_held < 0 && a.first_dof + i >= b.first_dof + j) {
            free_rows[b.first_dof + j].push_back(a.first_dof + i);
          }
        }
      }
    }
  }
}

void HessianAssembler::planElement(const std::vector<Entity>& entities, int local_size,
                                   ElementPlan& plan) {
  const auto source = [&](int row, int column) {
    return static_cast<std::uint16_t>(column * local_size + row);
  };
  plan.free_begin = static_cast<int>(runs_.size());
  for (const Entity& a : entities) {
    for (const Entity& b : entities) {
      if (a.first_held >= 0 || b.first_held >= 0 || a.first_dof < b.first_dof) continue;
      for (int j = 0; j < b.size; ++j) {
        const int skip = a.first_dof == b.first_dof ? j : 0;  // lower triangle only
        runs_.push_back({freePosition(a.first_dof + skip, b.first_dof + j),
                         source(a.local + skip, b.local + j),
                         static_cast<std::uint16_t>(a.size - skip)});
      }
    }
  }
  plan.free_end = plan.held_begin = static_cast<int>(runs_.size());
  for (const Entity& a : entities) {
    if (a.first_held < 0) continue;
    for (const Entity& b : entities) {
      const int column = b.first_held >= 0 ? map_.dof_count + b.first_held : b.first_dof;
      // The block is symmetric: its column a.local + i read downwards is row i of the held node.
      for (int i = 0; i < a.size; ++i) {
        runs_.push_back({heldPosition(a.first_held + i, column), source(b.local, a.local + i),
                         static_cast<std::uint16_t>(b.size)});
      }
    }
  }
  plan.held_end = static_cast<int>(runs_.size());
}

int HessianAssembler::freePosition(int row, int column) const {
  const auto begin = matrix_.row.begin() + matrix_.column_begin[column];
  const auto end = matrix_.row.begin() + matrix_.column_begin[column + 1];
  return static_cast<int>(std::lower_bound(begin, end, row) - matrix_.row.begin());
}

int HessianAssembler::heldPosition(int row, int column) const {
  const int* begin = held_.innerIndexPtr() + held_.outerIndexPtr()[row];
  const int* end = held_.innerIndexPtr() + held_.outerIndexPtr()[row + 1];
  return static_cast<int>(std::lower_bound(begin, end, column) - held_.innerIndexPtr());
}

void HessianAssembler::assemble(const Eigen::VectorXd& q, const ClipFrames& frames,
                                Projection projection) {
  std::fill(matrix_.value.begin(), matrix_.value.end(), 0.0);
  std::fill_n(held_.valuePtr(), held_.nonZeros(), 0.0);
  for (std::size_t t = 0; t < terms_.size(); ++t) {
    if (terms_[t]->stencils().empty()) continue;
    Sink sink(*this, t, q, frames);
    terms_[t]->addHessian(q, projection, sink);
  }
}

void HessianAssembler::addClipBlock(int clip, const Eigen::Matrix<double, 6, 6>& block) {
  const int first = map_.clip_dof[clip];
  for (int j = 0; j < 6; ++j) {
    for (int i = j; i < 6; ++i) matrix_.value[freePosition(first + i, first + j)] += block(i, j);
  }
}

}  // namespace tenter
