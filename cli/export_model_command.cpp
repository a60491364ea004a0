#include <cctype>
#include <filesystem>
#include <iostream>
#include <memory>

#include <fmt/core.h>

#include "cli/commands.h"
#include "forereach/dynamics/equations_header.h"
#include "records/output_file.h"
#include "task/config.h"

namespace forereach {
namespace {

struct ExportModelArguments {
  std::string config, name;
  std::string out = "robot_model.h";
  bool force = false;
};

// A word for C++ from the name of a model or file.
std::string WordOf(const std::string& name) {
  std::string word;
  for (const char c : name) word += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return word;
}

int ExportModel(const ExportModelArguments& options) {
  const Config config = LoadConfig(options.config, TransitionsFile::kIgnore);
  const ModelText* text = config.problem->model->text();
  if (text == nullptr)
    throw ConfigError("{}: model: {} is compiled already; what can be exported is a model with its equations as text",
                      options.config, config.problem->model->name());
  const bool is_inline = std::filesystem::path(text->file) == std::filesystem::path(options.config);
  const std::string own = is_inline ? std::filesystem::path(options.config).stem().string() : text->name;
  const std::string name = WordOf(options.name.empty() ? own : options.name);
  const std::string origin =
      fmt::format("The equations of {} as C++, written by `forereach export-model`. Write it again when they change.",
                  std::filesystem::path(text->file).filename().string());
  std::string header;
  try {
    header = EquationsHeader(*text, name, origin);
  } catch (const ExportError& error) {
    throw ConfigError(error.what());
  }
  WriteNewFile(options.out, header, options.force);
  std::cout << options.out << ": struct " << StructName(name) << "\n"
            << "  now: a certifier of your own, examples/certifier, with UseCompiled<" << StructName(name) << ">()"
            << std::endl;
  return 0;
}

}  // namespace

Command ExportModelCommand() {
  const auto options = std::make_shared<ExportModelArguments>();
  return {
      .name = "export-model",
      .footer =
          R"(A program of ten lines, examples/certifier/main.cpp, includes the header and is a certifier with these equations
as machine code. Its decisions have the same bits as those of forereach-certifier, which interprets the text, so
the task file stays as it is, and all other processes and commands go by it. It refuses a task with other
equations than those that it was built with; parameters and dt may differ.
Exported are equations of the next state (`next`), and rates with `integrator: euler`. A step of midpoint
or rk4 can be written out in `next`; docs/expressions.md, "At full speed", has an example and what it gains.

Example:
  forereach export-model config/bicycle_text.yaml --out robot_model.h)",
      .options = {TaskOption(options->config),
                  {"-o,--out", &options->out, "FILE.h", "The header"},
                  {"--name", &options->name, "WORD", "Of the struct; by default the model's name"},
                  {"--force", &options->force, "", "Overwrite the header if it exists"}},
      .run = [options] { return ExportModel(*options); }};
}

}  // namespace forereach
