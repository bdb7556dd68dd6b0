// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/served_rig.h"

#include <algorithm>
#include <sstream>

#include "tenter/core/files.h"
#include "tenter/rig/shipped_files.h"
#include "tenter/rig/tic_protocol.h"
#include "tenter/twin/fabrics.h"

namespace tenter {
namespace {

constexpr double kStart_units = 500.0;  // not at home: somebody has to find it
constexpr double kTravel_m = 0.09;
constexpr const char* kMap = "laumas-tlb";

std::string number(int index) { return std::to_string(index + 1); }
std::string serialOf(int index) { return "0000000" + number(index); }

}  // namespace

Result<std::unique_ptr<ServedRig>> ServedRig::start(const ServedRigOptions& options) {
  const auto fabric = findFabric(options.fabric);
  if (!fabric) return fabric.error();
  std::unique_ptr<ServedRig> rig(new ServedRig(options));
  rig->options_.state = std::filesystem::absolute(options.state);
  rig->fabric_N_per_m_ = {(*fabric)->membrane.base_N_per_m[0], (*fabric)->membrane.base_N_per_m[1]};
  std::error_code failed;
  std::filesystem::create_directories(rig->options_.state, failed);
  if (failed) return badInput(options.state.string(), "", failed.message());
  if (auto served = rig->serve(); !served) return served.error();
  auto written = writeFileAtomically(rig->configFile(), rig->configuration());
  if (!written) return written.error();
  return rig;
}

ServedRig::~ServedRig() {
  if (usb_) usb_->observe(nullptr);
}

Result<void> ServedRig::serve() {
  const auto map = parseRegisterMap(findShippedFile(shippedRegisterMaps(), kMap)->text, kMap);
  if (!map) return map.error();
  const auto shared_map = std::make_shared<const RegisterMap>(*map);
  VirtualUnits bus;
  for (int i = 0; i < kAxes; ++i) {
    VirtualCellOptions cell;
    cell.map = shared_map;
    cell.force_N = [this, i] { return tension_N(i); };
    cell.seed = options_.seed + static_cast<std::uint64_t>(i);
    cells_.push_back(std::make_shared<VirtualCell>(cell));
    bus[i + 1] = cells_.back();
    if (!options_.tcp) continue;
    auto server = VirtualModbus::serveTcp({{1, cells_.back()}});
    if (!server) return server.error();
    servers_.push_back(*std::move(server));
  }
  if (!options_.tcp) {
    VirtualRtuOptions rtu;
    rtu.link = options_.state / "bus";
    auto server = VirtualModbus::serveRtu(bus, rtu);
    if (!server) return server.error();
    servers_.push_back(*std::move(server));
  }
  std::vector<VirtualActuatorSpec> devices;
  for (int i = 0; i < kAxes; ++i) {
    VirtualActuatorSpec device;
    device.product = tic::kProducts[static_cast<std::size_t>(i) % tic::kProducts.size()].product;
    device.serial = serialOf(i);
    device.start_units = kStart_units;
    device.reverse_switch_units = 0.0;
    device.forward_switch_units = kTravel_m / kMetresPerMicrostep;
    position_m_[static_cast<std::size_t>(i)] = kStart_units * kMetresPerMicrostep;
    devices.push_back(device);
  }
  auto usb = VirtualUsb::create(std::move(devices));
  if (!usb) return usb.error();
  usb_ = *std::move(usb);
  usb_->observe([this](int device, const VirtualActuatorState& state) {
    position_m_[static_cast<std::size_t>(device)] = state.position_units * kMetresPerMicrostep;
  });
  return {};
}

/// Two bars with two cords each on a sheet: cords in series with the sheet, and the difference of a
/// bar's two cords turns the bar against the cords alone.
double ServedRig::tension_N(int axis) const {
  const int direction = axis / 4, first = 4 * direction, partner = axis ^ 1;
  double drawn_m = -kSlack_m;
  for (int i = 0; i < 4; ++i) drawn_m += 0.5 * position_m_[static_cast<std::size_t>(first + i)];
  const double series_N_per_m =
      1.0 / (1.0 / fabric_N_per_m_[static_cast<std::size_t>(direction)] + 1.0 / kCord_N_per_m);
  const double bar_N = series_N_per_m * std::max(0.0, drawn_m);
  const double turned_m =
      position_m_[static_cast<std::size_t>(axis)] - position_m_[static_cast<std::size_t>(partner)];
  const double cord_N = bar_N > 0.0 ? 0.5 * bar_N + 0.5 * kCord_N_per_m * 0.5 * turned_m : 0.0;
  return std::max(0.0, cord_N) + added_N_[static_cast<std::size_t>(axis)];
}

void ServedRig::addForce(int cell, double force_N) {
  added_N_.at(static_cast<std::size_t>(cell)) = force_N;
}

std::string ServedRig::configuration() const {
  std::ostringstream toml;
  toml << "# SPDX-License-Identifier: CC0-1.0\nschema_version = 1\nname = \"virtual rig, "
       << options_.fabric << "\"\n\n[limits]\nabsolute_N = 12.0\nworking_N = 10.0\n"
       << "slack_N = 0.05\nslope_N_per_s = 60.0\nstiffest_sample_N_per_m = 1000.0\n"
       << "following_error_m = 0.001\n";
  for (int i = 0; i < kAxes; ++i) {
    const VirtualModbus& server = *servers_[options_.tcp ? static_cast<std::size_t>(i) : 0];
    toml << "\n[[cell]]\nname = \"cell-" << number(i) << "\"\naddress = \"" << server.address()
         << "\"\nunit = " << (options_.tcp ? 1 : i + 1) << "\nmap = \"" << kMap
         << "\"\ncapacity_N = 50.0\nlowest_N = -1.0\n";
  }
  for (int i = 0; i < kAxes; ++i) {
    toml << "\n[[axis]]\nname = \"axis-" << number(i) << "\"\ndriver = \"tic\"\nserial = \""
         << serialOf(i) << "\"\nmetres_per_unit = " << kMetresPerMicrostep
         << "\ntravel_m = [0.0, 0.08]\nmax_speed_m_per_s = 0.004\n"
         << "max_acceleration_m_per_s2 = 0.1\ncell = \"cell-" << number(i) << "\"\n";
  }
  return toml.str();
}

}  // namespace tenter
