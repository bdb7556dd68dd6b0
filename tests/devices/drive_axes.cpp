// SPDX-License-Identifier: GPL-3.0-or-later
// A client that knows nothing of virtual devices: moves every axis until somebody ends it.
//   drive_axes COUNT [lac]
#include <cstdio>
#include <cstdlib>

#include "virtual_rig.h"

namespace {

using namespace tenter;  // NOLINT(google-build-using-namespace): a program of its own

int complain(const std::string& message) {
  std::fprintf(stderr, "%s\n", message.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 1;
  std::vector<AxisConfig> axes = device_test::ticAxes(count);
  if (argc > 2) axes.push_back(device_test::lacAxis());
  Result<ActuatorBank> bank = ActuatorBank::create(std::move(axes));
  if (!bank) return complain(bank.error().message());
  for (const AxisOutcome& outcome : bank->reconnectMissing(device_test::kConnectTimeout)) {
    if (!outcome.ok()) return complain(outcome.error().message());
  }
  const Actuator::Timeout patience = device_test::kPatience;
  for (int i = 0; i < bank->size(); ++i) {
    for (const AxisOutcome& outcome :
         {bank->axis(i).energise(patience), bank->axis(i).exitSafeStart(patience),
          bank->axis(i).setVelocity(0.5 * bank->axis(i).config().max_speed_m_per_s, patience)}) {
      if (!outcome.ok()) return complain(outcome.error().message());
    }
  }
  for (;;) {
    for (const AxisOutcome& outcome : bank->keepAliveAll(patience)) {
      if (!outcome.ok()) return complain(outcome.error().message());
    }
    device_test::sleepFor(0.02);
  }
}
