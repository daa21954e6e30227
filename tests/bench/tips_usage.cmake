# tips_bench says in words, and by its exit code, what it cannot simulate.
execute_process(COMMAND ${program} --preset preshaped --second-view-every 3 --out ${folder}
                RESULT_VARIABLE code OUTPUT_VARIABLE out ERROR_VARIABLE err)
if(NOT code STREQUAL "64" OR NOT err MATCHES "preset preshaped has one view; with two:.* biplane")
  message(FATAL_ERROR "expected exit code 64 and words, found ${code}: ${out}${err}")
endif()
if(EXISTS ${folder})
  message(FATAL_ERROR "${folder} was made")
endif()
