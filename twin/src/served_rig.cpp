// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/served_rig.h"

#include <algorithm>
#include <sstream>

#include "live_specimen.h"
#include "scene_source.h"
#include "tenter/core/files.h"
#include "tenter/rig/shipped_files.h"
#include "tenter/rig/tic_protocol.h"

namespace tenter {
namespace {

constexpr double kStart_units = 500.0;  // not at home: somebody has to find it
constexpr double kTravel_m = 0.09;
/// Clips hang on their cords at home too, and how much they pull there depends on what was before.
constexpr double kSlackFactor = 1.25, kSlack_N = 0.05;
constexpr const char* kMap = "laumas-tlb";

std::string number(int index) { return std::to_string(index + 1); }
std::string serialOf(int index) { return "0000000" + number(index); }

}  // namespace

Result<std::unique_ptr<ServedRig>> ServedRig::start(const ServedRigOptions& options) {
  std::error_code failed;
  std::filesystem::create_directories(options.state, failed);
  if (failed) return badInput(options.state.string(), "", failed.message());
  auto specimen = MountedSpecimen::hang(options.mount);
  if (!specimen) return specimen.error();
  std::unique_ptr<ServedRig> rig(new ServedRig(options, *std::move(specimen)));
  if (auto served = rig->serve(); !served) return served.error();
  const std::string mount = mountToJson(options.mount).dump(2) + "\n";
  for (const auto& [file, text] : {std::pair(rig->options_.state / "mount.json", mount),
                                   std::pair(rig->configFile(), rig->configuration())}) {
    if (auto written = writeFileAtomically(file, text); !written) return written.error();
  }
  return rig;
}

ServedRig::ServedRig(ServedRigOptions options, std::unique_ptr<MountedSpecimen> specimen)
    : options_(std::move(options)) {
  options_.state = std::filesystem::absolute(options_.state);
  const auto& tensions_N = specimen->moment().tension_N;
  home_N_ = *std::max_element(tensions_N.begin(), tensions_N.end());
  specimen_ = std::make_unique<LiveSpecimen>(std::move(specimen), options_.state / "truth.jsonl");
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
    cell.force_N = [this, i] { return felt_N(i); };
    cell.seed = options_.mount.seed + static_cast<std::uint64_t>(i);
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
  if (auto served = serveCameras(); !served) return served;
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
    follow(device, state.position_units * kMetresPerMicrostep);
  });
  return {};
}

Result<void> ServedRig::serveCameras() {
  if (options_.scene) {
    auto scene = prepareScene(options_, [this] { return specimen_->still(); });
    if (!scene) return scene.error();
    options_.cameras = *std::move(scene);
  }
  if (!options_.cameras) return {};
  auto cameras = VirtualCameras::serve(*options_.cameras);
  if (!cameras) return cameras.error();
  cameras_ = *std::move(cameras);
  return {};
}

/// Devices are told one after the other; with the last of them the specimen moves.
void ServedRig::follow(int device, double position_m) {
  position_m_[static_cast<std::size_t>(device)] = position_m;
  if (device != kAxes - 1) return;
  MountedSpecimen::Positions all{};
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = position_m_[i];
  specimen_->moveTo(all);
}

double ServedRig::tension_N(int axis) const { return specimen_->tension_N(axis); }

double ServedRig::felt_N(int axis) const {
  return specimen_->felt_N(axis) + added_N_.at(static_cast<std::size_t>(axis));
}

void ServedRig::addForce(int cell, double force_N) {
  added_N_.at(static_cast<std::size_t>(cell)) = force_N;
}

std::string servedRigToml(const std::string& name, std::optional<double> slack_N,
                          const std::vector<std::string>& addresses,
                          const std::vector<int>& units) {
  constexpr int kFirstPort = 15502;
  std::ostringstream toml;
  toml << "# SPDX-License-Identifier: CC0-1.0\nschema_version = 1\nname = \"" << name
       << "\"\n\n[limits]\nabsolute_N = 12.0\nworking_N = 10.0\n"
       << "slack_N = " << slack_N.value_or(kSlack_N)
       << "\nslope_N_per_s = 60.0\nstiffest_sample_N_per_m = 1000.0\n"
       << "following_error_m = 0.001\n";
  for (int i = 0; i < ServedRig::kAxes; ++i) {
    const auto place = static_cast<std::size_t>(i);
    const std::string address =
        addresses.empty() ? "tcp:127.0.0.1:" + std::to_string(kFirstPort + i) : addresses.at(place);
    toml << "\n[[cell]]\nname = \"cell-" << number(i) << "\"\naddress = \"" << address
         << "\"\nunit = " << (units.empty() ? 1 : units.at(place)) << "\nmap = \"" << kMap
         << "\"\ncapacity_N = 50.0\nlowest_N = -0.05\n";
  }
  for (int i = 0; i < ServedRig::kAxes; ++i) {
    toml << "\n[[axis]]\nname = \"axis-" << number(i) << "\"\ndriver = \"tic\"\nserial = \""
         << serialOf(i) << "\"\nmetres_per_unit = " << ServedRig::kMetresPerMicrostep
         << "\ntravel_m = [0.0, 0.08]\nmax_speed_m_per_s = 0.004\n"
         << "max_acceleration_m_per_s2 = 0.1\ncell = \"cell-" << number(i) << "\"\n";
  }
  return toml.str();
}

std::string ServedRig::configuration() const {
  std::vector<std::string> addresses;
  std::vector<int> units;
  for (int i = 0; i < kAxes; ++i) {
    addresses.push_back(servers_[options_.tcp ? static_cast<std::size_t>(i) : 0]->address());
    units.push_back(options_.tcp ? 1 : i + 1);
  }
  std::string toml =
      servedRigToml("virtual rig, " + options_.mount.fabric + ", " + options_.mount.protocol,
                    kSlackFactor * home_N_ + kSlack_N, addresses, units);
  if (cameras_) toml += cameras_->configuration();
  return toml;
}

}  // namespace tenter
