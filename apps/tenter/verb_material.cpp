// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>

#include "tenter/fitting/import.h"
#include "tenter/mechanics/material.h"
#include "verbs.h"

namespace tenter::app {

namespace {

using Severity = MaterialFinding::Severity;

struct Options {
  std::string file;
};

void declare(CLI::App& command, Options& o) {
  command.add_option("material", o.file, "Material file")->required();
}

const char* nameOf(Severity severity) {
  static constexpr std::array kNames = {"error", "warning", "note"};
  return kNames[static_cast<std::size_t>(severity)];
}

/// What checkMaterial cannot see: imported tables.
Result<void> addTableFindings(const Material& material, std::vector<MaterialFinding>& findings) {
  if (material.law != "arcsim") return {};
  const auto flagged = flagArcsimRows(material);
  if (!flagged) return flagged.error();
  for (const FlaggedRow& row : *flagged) {
    findings.push_back(
        {Severity::kError, row.table,
         "row " + std::to_string(row.row) + " is not positive definite: " + row.reason});
  }
  return {};
}

Result<int> check(const Options& o, Console& console) {
  const auto material = readMaterial(o.file);
  if (!material) return material.error();
  auto findings = checkMaterial(*material);
  if (auto done = addTableFindings(*material, findings); !done) return done.error().in(o.file);
  const bool ok = std::none_of(findings.begin(), findings.end(), [](const MaterialFinding& f) {
    return f.severity == Severity::kError;
  });
  auto& rows = console.answer["findings"] = nlohmann::json::array();
  for (const MaterialFinding& finding : findings) {
    rows.push_back({{"severity", nameOf(finding.severity)},
                    {"component", finding.component},
                    {"text", finding.text}});
    const std::string where = finding.component.empty() ? "" : finding.component + ": ";
    if (finding.severity == Severity::kError) {
      Console::complain(o.file + ": " + where + finding.text);
    } else {
      console.say(std::string(nameOf(finding.severity)) + ": " + where + finding.text);
    }
  }
  console.answer["ok"] = ok;
  console.say(o.file + (ok ? ": ok" : ": not usable as it is"));
  return ok ? kDone : static_cast<int>(ErrorKind::kBadInput);
}

}  // namespace

Verb materialVerb() {
  static constexpr std::array kRows = {
      Verb{"check", "Say what is wrong or doubtful in a material file; exit 3 on errors",
           [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, check); }}};
  return {"material", "Material files", [](CLI::App& command, Action& action) {
            command.require_subcommand(1);
            addSubcommands(command, kRows, action);
          }};
}

}  // namespace tenter::app
