// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/redecide.h"

#include <algorithm>

#include "rig_journal_kinds.h"

namespace tenter {

Result<void> Redecider::begin(const SessionHeader& header) {
  header_ = header;
  return {};
}

Result<void> Redecider::consume(const JournalRecord& record) {
  const auto* generic = std::get_if<GenericRecord>(&record.body);
  if (generic != nullptr && generic->kind == rig_journal::kMemory && !reader_) {
    auto config = parseRecordedRigConfig(header_.rig_configuration);
    if (!config) return config.error();
    auto protocol = parseCaptureProtocol(header_.protocol_text, "session.json: protocol_text");
    if (!protocol) return protocol.error();
    config_ = *std::move(config);
    if (config_.axes.size() != header_.actuators.size() ||
        config_.cells.size() != header_.cells.size()) {
      return badInput("session.json", "rig_configuration", "is that of another rig");
    }
    reader_ = std::make_unique<RigJournalReader>(
        config_, std::make_shared<const CaptureProtocol>(*std::move(protocol)));
  }
  if (reader_) {
    const auto taken = reader_->take(record);
    if (!taken) return taken.error();
    if (reader_->memory() && !machine_) {
      machine_ = std::make_unique<RigMachine>(config_, *reader_->memory());
    }
  }
  const auto* sample = std::get_if<SampleRecord>(&record.body);
  if (sample != nullptr && machine_) return tick(*sample, record.time_ns);
  if (isEvent(record.body)) compare(record);
  return {};
}

Result<void> Redecider::tick(const SampleRecord& sample, std::int64_t time_ns) {
  flush();
  const RigOrders orders = machine_->step(reader_->tickOf(sample, time_ns));
  ++ticks_;
  for (const RecordBody& body : orders.records) {
    if (!isEvent(body)) continue;
    auto line = eventLine(time_ns, body, header_);
    if (!line) return line.error();
    expected_.push_back(*std::move(line));
  }
  return {};
}

/// What the machine decided and nobody recorded.
void Redecider::flush() {
  for (const std::string& line : expected_) decided_ += line + '\n';
  expected_.clear();
}

void Redecider::compare(const JournalRecord& record) {
  const std::string line = eventLine(record);
  recorded_ += line + '\n';
  if (const auto* session = std::get_if<SessionEvent>(&record.body)) {
    // A tick that a crash cut short may have lost its last events.
    if (session->what == "resumed") expected_.clear();
    flush();
    closed_ = session->what == "closed";
    decided_ += line + '\n';
    return;
  }
  if (!expected_.empty() && expected_.front() == line) {
    decided_ += expected_.front() + '\n';
    expected_.pop_front();
  } else if (!machine_ || std::holds_alternative<FaultEvent>(record.body)) {
    decided_ += line + '\n';
  }
}

Result<void> Redecider::end() {
  if (closed_) flush();
  return {};
}

std::uint64_t Redecider::lines() const {
  return static_cast<std::uint64_t>(std::count(decided_.begin(), decided_.end(), '\n'));
}

std::uint64_t Redecider::firstDifference() const {
  const auto [decided, recorded] =
      std::mismatch(decided_.begin(), decided_.end(), recorded_.begin(), recorded_.end());
  return 1 + static_cast<std::uint64_t>(std::count(decided_.begin(), decided, '\n'));
}

}  // namespace tenter
