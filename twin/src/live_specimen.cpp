// SPDX-License-Identifier: GPL-3.0-or-later
#include "live_specimen.h"

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "rig_noise.h"
#include "rig_setup.h"
#include "yield_to_others.h"

namespace tenter {
namespace {

using namespace std::chrono_literals;

/// Way of an actuator after which a new equilibrium is due: to first order tensions err by some
/// micronewtons over it.
constexpr double kDue_m = 2e-5;
/// What is less is no motion.
constexpr double kMoves_m = 1e-5;
/// Between two solutions, so that the rest of the machine comes to its turn too.
constexpr auto kPause = 40ms;

constexpr CordFriction kPulley{RigErrors::kCordFriction_N};

bool isDue(const LiveSpecimen::Positions& from, const LiveSpecimen::Positions& to) {
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (std::abs(to[i] - from[i]) > kDue_m) return true;
  }
  return false;
}

}  // namespace

LiveSpecimen::LiveSpecimen(std::unique_ptr<MountedSpecimen> specimen,
                           const std::filesystem::path& truth)
    : specimen_(std::move(specimen)),
      positions_m_(specimen_->moment().at_m),
      moment_(specimen_->moment()),
      still_(makeStill()),
      flat_(still_ ? std::make_shared<const Still>(Still{{}, flatSample()}) : nullptr),
      friction_{kPulley, kPulley, kPulley, kPulley, kPulley, kPulley, kPulley, kPulley} {
  if (!truth.empty()) truth_.open(truth);
  writeTruth();
  thread_ = std::thread([this] { run(); });
}

LiveSpecimen::~LiveSpecimen() {
  {
    const std::lock_guard lock(mutex_);
    quitting_ = true;
  }
  moved_.notify_one();
  thread_.join();
}

void LiveSpecimen::moveTo(const Positions& positions_m) {
  const std::lock_guard lock(mutex_);
  positions_m_ = positions_m;
  for (std::size_t i = 0; i < positions_m.size(); ++i) {
    if (found_m_[i] == 0.0) found_m_[i] = positions_m[i];
    hung_ = hung_ || std::abs(positions_m[i] - found_m_[i]) > kMoves_m;
  }
  for (int i = 0; i < MountedSpecimen::kAxes; ++i) {
    const auto axis = static_cast<std::size_t>(i);
    friction_[axis].follow(
        specimen_->cordLength_m(i, positions_m[axis], moment_.tensionNear_N(i, positions_m)));
  }
  if (isDue(moment_.at_m, positions_m_)) moved_.notify_one();
}

double LiveSpecimen::pull_N(int axis) const {
  return specimen_->hookTension_N(axis, positions_m_.at(static_cast<std::size_t>(axis))) +
         moment_.tensionNear_N(axis, positions_m_);
}

double LiveSpecimen::tension_N(int axis) const {
  const std::lock_guard lock(mutex_);
  return pull_N(axis);
}

double LiveSpecimen::felt_N(int axis) const {
  const std::lock_guard lock(mutex_);
  return std::max(0.0, pull_N(axis) + friction_.at(static_cast<std::size_t>(axis)).force_N());
}

std::shared_ptr<const LiveSpecimen::Still> LiveSpecimen::still() const {
  const std::lock_guard lock(mutex_);
  return hung_ ? still_ : flat_;
}

std::shared_ptr<const LiveSpecimen::Still> LiveSpecimen::makeStill() const {
  auto shape = specimen_->shape();
  if (!shape) return nullptr;
  return std::make_shared<const Still>(Still{specimen_->moment().at_m, *std::move(shape)});
}

void LiveSpecimen::run() {
  yieldToOthers(kMathematicsNice);
  std::unique_lock lock(mutex_);
  while (!quitting_) {
    moved_.wait(lock, [this] { return quitting_ || isDue(moment_.at_m, positions_m_); });
    if (quitting_) return;
    const Positions wanted_m = positions_m_;
    lock.unlock();
    specimen_->follow(wanted_m);  // where it fails, readers go on along the last equilibrium
    writeTruth();
    auto still = makeStill();
    lock.lock();
    moment_ = specimen_->moment();
    still_ = std::move(still);
    moved_.wait_for(lock, kPause, [this] { return quitting_; });
  }
}

void LiveSpecimen::writeTruth() {
  if (!truth_.is_open()) return;
  const MountedSpecimen::Moment& moment = specimen_->moment();
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  truth_ << nlohmann::json{{"monotonic_ns", std::chrono::nanoseconds(now).count()},
                           {"positions_m", moment.at_m},
                           {"tensions_N", moment.tension_N},
                           {"failures", specimen_->statistics().failures},
                           {"foretold_rms_N", specimen_->statistics().rmsError_N()},
                           {"foretold_largest_N", specimen_->statistics().largest_error_N}}
                .dump()
         << '\n';
  truth_.flush();
}

}  // namespace tenter
