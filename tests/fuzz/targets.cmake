# The fuzz targets themselves: in a build of their own with clang, sanitizers and TUBED_FUZZ=ON, which build_targets.sh makes.
# Each target links the folders that it tests, and no more: what is compiled here is compiled a second time.
function(tubed_fuzz_target name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  list(TRANSFORM arg_SOURCES PREPEND ${PROJECT_SOURCE_DIR}/)
  add_executable(fuzz_${name} ${PROJECT_SOURCE_DIR}/tests/fuzz/fuzz_${name}.cpp ${arg_SOURCES})
  target_link_libraries(fuzz_${name} PRIVATE tubed_options ${arg_LINK})
  target_link_options(fuzz_${name} PRIVATE -fsanitize=fuzzer)
  add_dependencies(fuzz_targets fuzz_${name})
endfunction()

add_custom_target(fuzz_targets)
tubed_fuzz_target(replies LINK drivers_aurora)
tubed_fuzz_target(text LINK drivers_aurora)
tubed_fuzz_target(can LINK drivers_aurora)
tubed_fuzz_target(session LINK drivers_aurora)
file(GLOB judgements RELATIVE ${PROJECT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/clients/tubectl/check/aurora_*judgement*.cpp)
tubed_fuzz_target(wire_log LINK drivers_aurora nlohmann_json::nlohmann_json
                  SOURCES ${judgements} clients/tubectl/check/aurora_assumptions.cpp clients/tubectl/check/assumption_table.cpp
                          clients/tubectl/check/wire_conversation.cpp)
tubed_fuzz_target(shm_image LINK drivers_image_shm Threads::Threads)
tubed_fuzz_target(shm_estimate LINK tubed_shm drivers_interface Threads::Threads)
file(GLOB config RELATIVE ${PROJECT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/daemon/config/*.cpp)
list(FILTER config EXCLUDE REGEX "sample_configuration")
set(drivers ${TUBED_DRIVERS})
list(REMOVE_ITEM drivers simulation)
list(TRANSFORM drivers PREPEND drivers_ OUTPUT_VARIABLE driver_targets)
tubed_driver_list(${PROJECT_BINARY_DIR}/fuzz_driver_list.cpp ${drivers})
tubed_fuzz_target(configuration SOURCES ${config} drivers/driver_registry/find_driver.cpp
                  LINK idl_geometry idl_settings ${driver_targets} idl tubed_idl tomlplusplus::tomlplusplus OpenSSL::Crypto)
target_sources(fuzz_configuration PRIVATE ${PROJECT_BINARY_DIR}/fuzz_driver_list.cpp)
tubed_fuzz_target(sequence LINK drivers_replay)
tubed_fuzz_target(picture LINK drivers_v4l2)
if(TARGET clients_dicom)
  tubed_fuzz_target(dicom LINK clients_dicom)
endif()
file(GLOB vessel RELATIVE ${PROJECT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/drivers/laboratory/vessel/vessel*.cpp)
tubed_fuzz_target(vessel SOURCES ${vessel} drivers/laboratory/vessel/surface_mesh.cpp drivers/laboratory/vessel/wall_field.cpp LINK Eigen3::Eigen)
# What prints samples, for the two targets that print.
add_library(fuzz_printing STATIC EXCLUDE_FROM_ALL ${PROJECT_SOURCE_DIR}/clients/tubectl/watch/sample_json.cpp
                                                  ${PROJECT_SOURCE_DIR}/clients/tubectl/watch/sample_line.cpp)
target_link_libraries(fuzz_printing PUBLIC tubed_client nlohmann_json::nlohmann_json)
target_compile_definitions(fuzz_printing PUBLIC FMT_HEADER_ONLY)  # as the targets have it whose sources these are
tubed_fuzz_target(estimate LINK fuzz_printing
                  SOURCES clients/evaluation/latency_statistics.cpp clients/tubectl/watch/stream_statistics.cpp clients/tubectl/watch/status_line.cpp
                          clients/evaluation/statistics.cpp)
tubed_fuzz_target(reports SOURCES clients/exporter/metrics_text.cpp LINK fuzz_printing)
