"""The folder of a law in C: sources, a C++ header, a CMake package that is an ament package too, an example, a test."""

from __future__ import annotations

from pathlib import Path

from palpate_native.module import Argument, Entry, Module, Sources
from palpate_native.recording import PRESS, Recording
from palpate_native.replay import program, write_rows

_CMAKE = """# Made by palpate
cmake_minimum_required(VERSION 3.16)
project({name} C)

add_library({name} STATIC {name}.c)
target_include_directories({name} PUBLIC
  $<BUILD_INTERFACE:${{CMAKE_CURRENT_SOURCE_DIR}}> $<INSTALL_INTERFACE:include>)
set_target_properties({name} PROPERTIES C_STANDARD 99 C_STANDARD_REQUIRED ON C_EXTENSIONS OFF
  POSITION_INDEPENDENT_CODE ON)
target_compile_options({name} PRIVATE -ffp-contract=off -fno-math-errno -Wall -Wextra -Wconversion -Wpedantic)
find_library(MATH m)
if(MATH)
  target_link_libraries({name} PUBLIC m)
endif()

install(FILES {name}.h {name}.hpp DESTINATION include)
install(TARGETS {name} EXPORT {name}Targets ARCHIVE DESTINATION lib)
install(EXPORT {name}Targets NAMESPACE {name}:: DESTINATION share/{name}/cmake)

include(CTest)
if(BUILD_TESTING)
  add_executable(replay test/replay.c)
  target_link_libraries(replay {name})
  add_test(NAME recorded_press COMMAND replay ${{CMAKE_CURRENT_SOURCE_DIR}}/test/press.bin)
endif()

find_package(Python3 COMPONENTS Interpreter QUIET)
if(Python3_FOUND)
  execute_process(COMMAND ${{Python3_EXECUTABLE}} -c "import ament_package" RESULT_VARIABLE NO_AMENT ERROR_QUIET)
  if(NO_AMENT EQUAL 0)
    find_package(ament_cmake QUIET)
  endif()
endif()
if(ament_cmake_FOUND)
  ament_export_targets({name}Targets)
  ament_package()
else()
  message(STATUS "a plain CMake package: there is no ament_cmake, or ${{Python3_EXECUTABLE}} has no ament_package; "
    "-DPython3_EXECUTABLE=... names another Python")
  file(WRITE ${{CMAKE_CURRENT_BINARY_DIR}}/{name}Config.cmake
    "include(\\${{CMAKE_CURRENT_LIST_DIR}}/{name}Targets.cmake)\\n")
  install(FILES ${{CMAKE_CURRENT_BINARY_DIR}}/{name}Config.cmake DESTINATION share/{name}/cmake)
endif()
"""
_MANIFEST = """<?xml version="1.0"?>
<!-- Made by palpate -->
<package format="3">
  <name>{name}</name>
  <version>{version}</version>
  <description>A law of palpate in C: it {title}.</description>
  <maintainer email="nobody@example.org">who exported it</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
"""
_CPP = """// Made by palpate: {name}.hpp, the law as a class of C++17.
#ifndef {guard}_HPP
#define {guard}_HPP

#include "{name}.h"

#include <array>
#include <string_view>

namespace palpate {{

/* One state of the law; it allocates nothing and throws nothing. The gains outlive it. */
class {cls} {{
public:
    explicit {cls}(const {name}_gains &gains = {name}_default_gains) noexcept : gains_(&gains) {{ reset(); }}
    void reset() noexcept {{ {name}_init(gains_, &state_); }}
{methods}
    const {name}_state &state() const noexcept {{ return state_; }}

private:
    const {name}_gains *gains_;
    {name}_state state_{{}};
}};

}} // namespace palpate

#endif // {guard}_HPP
"""
_READ = """<!-- Made by palpate -->
# {name}

It {title}. `{name}.c` was translated from palpate's laws, equal to the last bit with them; `palpate export --to c`
makes it again, and there is nothing to edit in it.

{notes}

    cmake -S . -B build && cmake --build build && ctest --test-dir build

`test/replay` repeats ticks that Python recorded, faults among them, and compares values and states by their bits.
Each operation has to be that of IEEE doubles: compile with `-ffp-contract=off`, and never with `-ffast-math`.
"""
_EXAMPLE = """// Made by palpate: an arm that follows its command at once presses on a spring.
#include "palpate_force.h"

#include <stdio.h>

int main(void) {
    const palpate_force_gains *gains = &palpate_force_default_gains;
    const double tick = gains->tick, wall = 0.002, stiffness = 0.1 * gains->cap, desired = %s;
    palpate_force_state state;
    double position = 0.0, force = 0.0;
    unsigned noise = 1;

    palpate_force_init(gains, &state);
    for (int k = 0; k < 5000; ++k) {
        noise = 1664525u * noise + 1013904223u;
        force = position > wall ? stiffness * (position - wall) : 0.0;
        force += gains->noise * ((double)(noise >> 8) / 8388608.0 - 1.0);
        position += tick * palpate_force_update(gains, &state, desired, force, position, 0.0);
        if (k %% 500 == 499) {
            printf("%%5.2f s  %%7.3f N  %%s %%s\\n", tick * (k + 1), force, palpate_force_phase(&state),
                palpate_force_trouble(&state));
        }
    }
    printf("stiffness: %%.0f N/m\\n", palpate_force_estimate(gains, &state).stiffness);
    return 0;
}
"""
_ROS = """// Made by palpate: update() of a ros2_control controller around the force loop. No test compiles it.
#include "palpate_force.hpp"

#include <controller_interface/controller_interface.hpp>

#include <algorithm>
#include <cmath>

class PressController : public controller_interface::ControllerInterface {
public: // on_init and the configurations of both kinds of interfaces are those of your arm
    controller_interface::CallbackReturn on_activate(const rclcpp_lifecycle::State &) override {
        loop_.reset();
        command_ = state_interfaces_[1].get_value(); // the first command is where the tip is
        return controller_interface::CallbackReturn::SUCCESS;
    }
    controller_interface::return_type update(const rclcpp::Time &, const rclcpp::Duration &period) override {
        const double force = state_interfaces_[0].get_value();    // along the normal, positive where it presses [N]
        const double position = state_interfaces_[1].get_value(); // along the normal, growing into the surface [m]
        const double tick = palpate_force_default_gains.tick;
        const double missed = std::max(0.0, std::round(period.seconds() / tick) - 1.0);
        command_ += tick * loop_.update(desired_, force, position, missed);
        command_interfaces_[0].set_value(command_);
        return controller_interface::return_type::OK;
    }

private:
    palpate::Force loop_;
    double desired_ = %s, command_ = 0.0;
};
"""


def files_of(
    module: Module, sources: Sources, recording: Recording, version: str, desired: float
) -> dict[str, str]:
    """The texts of a folder by their names; the recorded press is not among them."""
    name = module.name
    notes = "\n".join(f"    {note}" for note in module.notes)
    texts = {
        f"{name}.h": sources.header,
        f"{name}.c": sources.source,
        f"{name}.hpp": _cpp(module),
        "CMakeLists.txt": _CMAKE.format(name=name),
        "package.xml": _MANIFEST.format(name=name, version=version, title=module.title),
        "README.md": _READ.format(name=name, title=module.title, notes=notes),
        "test/replay.c": program(module, recording.inputs),
    }
    if name == "palpate_force":
        texts["example/press.c"] = _EXAMPLE % repr(desired)
        texts["example/ros2_controller.cpp"] = _ROS % repr(desired)
    return texts


def write_folder(folder: Path, texts: dict[str, str], recording: Recording) -> None:
    """Writes the texts, and a recorded press beside the test."""
    for name, text in texts.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8", newline="\n")
    write_rows(folder / "test" / "press.bin", recording.presses(PRESS // 2, 0))


def _cpp(module: Module) -> str:
    name = module.name
    methods = "\n".join(_method(module, entry) for entry in module.entries)
    words = "".join(
        f"\n    std::string_view {word}() const noexcept {{ return {name}_{word}(&state_); }}"
        for word in module.words
    )
    cls = name.removeprefix("palpate_").capitalize()
    return _CPP.format(name=name, guard=name.upper(), cls=cls, methods=methods + words)


def _method(module: Module, entry: Entry) -> str:
    arguments = ", ".join(_parameter(argument) for argument in entry.arguments)
    values = ["gains_", "&state_", *(f"{a.name}.data()" if a.shape else a.name for a in entry.arguments)]
    constant = "" if entry.name == "update" else "const "
    return (
        f"    auto {entry.name}({arguments}) {constant}noexcept {{\n"
        f"        return {module.name}_{entry.name}({', '.join(values)});\n    }}"
    )


def _parameter(argument: Argument) -> str:
    if not argument.shape:
        return f"double {argument.name}"
    return f"{'' if argument.out else 'const '}std::array<double, {argument.count}> &{argument.name}"
