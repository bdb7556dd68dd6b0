// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/test_support/json_schema.h"

#include <fstream>
#include <stdexcept>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>

namespace tenter::test_support {

std::vector<std::string> schemaErrors(const nlohmann::json& document,
                                      const std::filesystem::path& schema_file) {
  std::ifstream in(schema_file);
  if (!in) throw std::runtime_error("cannot read " + schema_file.string());
  const nlohmann::json schema_json = nlohmann::json::parse(in);

  valijson::Schema schema;
  valijson::SchemaParser parser;
  parser.populateSchema(valijson::adapters::NlohmannJsonAdapter(schema_json), schema);

  valijson::Validator validator;
  valijson::ValidationResults results;
  validator.validate(schema, valijson::adapters::NlohmannJsonAdapter(document), &results);

  std::vector<std::string> errors;
  valijson::ValidationResults::Error error;
  while (results.popError(error)) {
    std::string place;
    for (const std::string& step : error.context) place += step;
    errors.push_back(place + ": " + error.description);
  }
  return errors;
}

}  // namespace tenter::test_support
