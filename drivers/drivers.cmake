# Drivers are found, not listed: a folder drivers/NAME with NAME_driver.hpp is one, its target drivers_NAME, and NAME_driver() of
# that header is what the registry asks. Where it needs more, its driver.cmake sets
#   driver_libraries       what it is linked with beside drivers/interface
#   driver_test_libraries  what tests/drivers/NAME needs beside the driver
#   driver_place           its place in messages and in the sample configuration; those without one come last, by name
file(GLOB driver_headers CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/drivers/*/*_driver.hpp)
if(TUBED_DEMO_ONLY)
  list(FILTER driver_headers INCLUDE REGEX "/simulation_driver\\.hpp$")
endif()
set(placed_drivers)
foreach(header ${driver_headers})
  get_filename_component(folder ${header} DIRECTORY)
  get_filename_component(driver ${folder} NAME)
  get_filename_component(file ${header} NAME)
  if(NOT file STREQUAL ${driver}_driver.hpp)
    continue()
  endif()
  set(driver_libraries)
  set(driver_test_libraries)
  set(driver_place 99)
  include(${folder}/driver.cmake OPTIONAL)
  tubed_library(drivers/${driver} drivers_interface ${driver_libraries})
  set(TUBED_DRIVER_TESTS_${driver} drivers_${driver} ${driver_test_libraries})
  list(APPEND placed_drivers "${driver_place} ${driver}")
endforeach()
list(SORT placed_drivers COMPARE NATURAL)
list(TRANSFORM placed_drivers REPLACE "^[0-9]+ " "" OUTPUT_VARIABLE TUBED_DRIVERS)

# Writes the source of drivers(), with these drivers in that order.
function(tubed_driver_list output)
  set(driver_includes)
  set(driver_calls)
  foreach(driver ${ARGN})
    string(APPEND driver_includes "#include \"drivers/${driver}/${driver}_driver.hpp\"\n")
    string(APPEND driver_calls "\n      ${driver}_driver(),")
  endforeach()
  configure_file(${PROJECT_SOURCE_DIR}/drivers/driver_registry/driver_list.cpp.in ${output} @ONLY)
endfunction()

list(TRANSFORM TUBED_DRIVERS PREPEND drivers_ OUTPUT_VARIABLE driver_targets)
tubed_library(drivers/driver_registry drivers_interface ${driver_targets})
tubed_driver_list(${PROJECT_BINARY_DIR}/driver_list.cpp ${TUBED_DRIVERS})
target_sources(drivers_driver_registry PRIVATE ${PROJECT_BINARY_DIR}/driver_list.cpp)
