// SPDX-License-Identifier: GPL-3.0-or-later
#include "rpc.h"

#include <algorithm>
#include <array>
#include <filesystem>

#include "daemon_log.h"
#include "tenter/core/json_reader.h"
#include "tenter/rig/load_cell.h"

namespace tenter::daemon {
namespace {

using Json = nlohmann::json;
using Kind = RigCommand::Kind;
using Range = JsonReader::Range;

constexpr int kParseError = -32700, kInvalidRequest = -32600, kNoMethod = -32601;
constexpr int kRefused = -32000;
/// Until all cameras are open: some seconds after the daemon has started.
constexpr std::chrono::seconds kCamerasLimit{10};
constexpr std::size_t kMaxText = 256, kMaxProtocol_bytes = 512 * 1024;

struct PlainRow {
  std::string_view method;
  Kind kind;
  /// Also from another program of the user who holds the lease: a second terminal beside the run.
  bool beside_the_run = false;
};
/// Commands without parameters, for whoever holds the lease.
constexpr std::array kPlain{
    PlainRow{"enable", Kind::kEnable},     PlainRow{"disable", Kind::kDisable},
    PlainRow{"home", Kind::kHome},         PlainRow{"tare", Kind::kTare},
    PlainRow{"pause", Kind::kPause, true}, PlainRow{"resume", Kind::kResume, true},
    PlainRow{"abort", Kind::kAbort, true}, PlainRow{"reset", Kind::kReset},
    PlainRow{"unload", Kind::kUnload}};

const PlainRow* findPlain(std::string_view method) {
  const auto row = std::find_if(kPlain.begin(), kPlain.end(),
                                [&](const PlainRow& r) { return r.method == method; });
  return row == kPlain.end() ? nullptr : &*row;
}

std::string failure(const Json& id, int code, const std::string& message) {
  return Json{{"jsonrpc", "2.0"}, {"id", id}, {"error", {{"code", code}, {"message", message}}}}
      .dump(-1, ' ', false, Json::error_handler_t::replace);
}

SessionHeader headerFrom(JsonReader& in, const CaptureProtocol& protocol, const RigConfig& rig) {
  SessionHeader header;
  const auto now = std::chrono::system_clock::now();
  header.start_utc = utcStamp(now);
  header.id =
      protocol.name + "-" +
      std::to_string(
          std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count());
  header.who = in.text("who", kMaxText);
  header.operator_name = in.text("operator", kMaxText);
  header.fabric = in.text("fabric", kMaxText);
  header.specimen = in.text("specimen", kMaxText);
  header.areal_density_kg_per_m2 = in.number("areal_density_kg_per_m2", Range::positive(100.0));
  if (in.has("temperature_degC"))
    header.temperature_degC = in.number("temperature_degC", Range::between(-50.0, 100.0));
  if (in.has("relative_humidity"))
    header.relative_humidity = in.number("relative_humidity", Range::between(0.0, 1.0));
  header.protocol = protocol.name;
  header.protocol_text = protocol.text;
  header.rig_configuration = rig.text;
  header.calibration_ids = rig.calibration_ids;
  for (const RigAxis& axis : rig.axes) header.actuators.push_back(axis.device.name);
  for (const LoadCellConfig& cell : rig.cells) header.cells.push_back(cell.id);
  return header;
}

}  // namespace

void Rpc::tick() { service_.setOperated(lease_.held(monotonic_ns())); }

void Rpc::clientGone(const Client& client) { lease_.release(client.connection); }

std::string Rpc::answer(std::string_view line, const Client& client,
                        std::vector<Descriptor>& attached) {
  const auto parsed = parseJson(line, "request");
  if (!parsed) return failure(nullptr, kParseError, parsed.error().message());
  const Json& request = *parsed;
  const bool valid = request.is_object() && request.value("jsonrpc", Json()) == "2.0" &&
                     request.contains("method") && request["method"].is_string();
  if (!valid) return failure(nullptr, kInvalidRequest, "not a JSON-RPC 2.0 request");
  const Json id = request.value("id", Json());
  if (!id.is_null() && !id.is_string() && !id.is_number_integer()) {
    return failure(nullptr, kInvalidRequest, "id must be a text or a whole number");
  }
  const Json params = request.value("params", Json::object());
  const std::string method = request["method"];
  const auto result = dispatch(method, params, client, attached);
  if (!request.contains("id")) return "";
  if (result) {
    return Json{{"jsonrpc", "2.0"}, {"id", id}, {"result", *result}}.dump(
        -1, ' ', false, Json::error_handler_t::replace);
  }
  const bool unknown = result.error().kind == ErrorKind::kUsage;
  return Json{{"jsonrpc", "2.0"},
              {"id", id},
              {"error",
               {{"code", unknown ? kNoMethod : kRefused},
                {"message", result.error().message()},
                {"data", {{"kind", static_cast<int>(result.error().kind)}}}}}}
      .dump(-1, ' ', false, Json::error_handler_t::replace);
}

Result<Json> Rpc::dispatch(const std::string& method, const Json& params, const Client& client,
                           std::vector<Descriptor>& attached) {
  const std::int64_t now_ns = monotonic_ns();
  if (method == "stop") {
    service_.stopNow();
    logEvent(LogLevel::kWarning, "stop", {{"user", client.user}});
    return Json{{"halted", true}};
  }
  if (client.only_stops) {
    return Error{ErrorKind::kInterlock, "", "", "too many clients: this one may only stop the rig",
                 "end other programs that talk to tenterd"};
  }
  if (method == "status") return status();
  if (method == "frames") return frames(attached);
  if (method == "lease") {
    const Lease::Taken taken = lease_.acquire(client.connection, client.user, now_ns);
    if (taken == Lease::Taken::kRefused) {
      return Error{ErrorKind::kInterlock, "", "", lease_.holder(now_ns) + " operates the rig",
                   "anybody may stop it"};
    }
    if (taken == Lease::Taken::kNew) service_.operatorChanged();
    tick();
    return Json{{"seconds", 1e-9 * static_cast<double>(Lease::kLength_ns)}};
  }
  if (method == "heartbeat") {
    if (lease_.renew(client.connection, now_ns)) return Json::object();
    return Error{ErrorKind::kInterlock, "", "", "this client does not operate the rig", ""};
  }
  const PlainRow* row = findPlain(method);
  const bool known =
      row != nullptr || method == "jog" || method == "run" || method == "check-mapping";
  if (!known) {
    return usageError("there is no method \"" + method + "\"");
  }
  const bool beside =
      row != nullptr && row->beside_the_run && lease_.heldByUser(client.user, now_ns);
  if (!beside && !lease_.heldBy(client.connection, now_ns)) {
    return Error{ErrorKind::kInterlock, "", "", "this client does not operate the rig",
                 "call lease first"};
  }
  logEvent(LogLevel::kInfo, "command", {{"method", method}, {"user", client.user}});
  if (row != nullptr) return plain(row->kind);
  if (method == "check-mapping") return checkMapping(params);
  return method == "jog" ? jog(params) : run(params, client);
}

Result<Json> Rpc::status() const {
  Json status = service_.status();
  status["operator"] = lease_.holder(monotonic_ns());
  const std::lock_guard lock(mutex_);
  if (recorder_) {
    status["session"] = {{"folder", recorder_->folder()},
                         {"closed", recorder_->closed()},
                         {"fault", recorder_->fault()}};
  }
  return status;
}

Result<Json> Rpc::frames(std::vector<Descriptor>& attached) {
  const auto set = service_.cameras().look();
  if (!set) return set.error();
  return shareFrames(**set, service_.cameras().section(), attached);
}

Result<Json> Rpc::plain(Kind kind) {
  RigCommand command;
  command.kind = kind;
  if (auto done = service_.command(command); !done) return done.error();
  return Json::object();
}

Result<Json> Rpc::checkMapping(const Json& params) {
  JsonReader in(params, "params");
  RigCommand command;
  command.kind = Kind::kCheckMapping;
  const std::vector<std::string> names =
      in.has("axes") ? in.texts("axes") : std::vector<std::string>();
  for (const std::string& name : names) {
    const auto axis = service_.config().findAxis(name);
    if (!axis) in.fail("axes", "there is no axis \"" + name + "\"");
    command.axes.push_back(axis.value_or(0));
  }
  if (!in.ok()) return in.error();
  if (auto done = service_.command(command); !done) return done.error();
  return Json::object();
}

Result<Json> Rpc::jog(const Json& params) {
  JsonReader in(params, "params");
  const std::string name = in.text("axis", kMaxText);
  RigCommand command;
  command.kind = Kind::kJog;
  command.distance_m = in.number("distance_m", Range::between(-10.0, 10.0));
  command.speed_m_per_s = in.number("speed_m_per_s", Range::positive(10.0));
  const auto axis = service_.config().findAxis(name);
  if (in.ok() && !axis) in.fail("axis", "there is no axis \"" + name + "\"");
  if (!in.ok()) return in.error();
  command.axis = *axis;
  if (auto done = service_.command(command); !done) return done.error();
  return Json::object();
}

Result<Json> Rpc::run(const Json& params, const Client& client) {
  JsonReader in(params, "params");
  const std::string text = in.text("protocol", kMaxProtocol_bytes);
  const std::string folder = in.text("session", 4096);
  if (in.ok() && !std::filesystem::path(folder).is_absolute()) {
    in.fail("session", "must be an absolute path");
  }
  if (!in.ok()) return in.error();
  const auto protocol = parseCaptureProtocol(text, "protocol");
  if (!protocol) return protocol.error();
  if (auto fits = checkAgainstRig(*protocol, service_.config()); !fits) return fits.error();
  const bool skip_mapping = in.has("skip_mapping_check") && in.boolean("skip_mapping_check");
  const SessionHeader header = headerFrom(in, *protocol, service_.config());
  if (!in.ok()) return in.error();
  if (auto seen = service_.cameras().awaitAll(kCamerasLimit); !seen) return seen.error();
  auto writer = SessionWriter::create(folder, header);
  if (!writer) return writer.error();
  // Cameras or a busy disk may have taken longer than the lease lasts, and the client waited for
  // it.
  const bool still_operates = lease_.extend(client.connection, monotonic_ns());
  tick();
  RigCommand command;
  command.kind = Kind::kRun;
  command.protocol = std::make_shared<CaptureProtocol>(*protocol);
  command.mapping = skip_mapping ? RigCommand::Mapping::kSkip : RigCommand::Mapping::kCheck;
  auto recorder = std::make_shared<Recorder>(*std::move(writer), monotonic_ns());
  auto done = still_operates ? service_.command(command, recorder)
                             : Error{ErrorKind::kInterlock, "", "",
                                     "this client does not operate the rig", ""};
  if (!done) {
    recorder.reset();
    std::error_code ignored;  // what is left then holds its two records and says so
    std::filesystem::remove_all(folder, ignored);
    return done.error();
  }
  const std::lock_guard lock(mutex_);
  recorder_ = recorder;
  return Json{{"session", folder}};
}

}  // namespace tenter::daemon
