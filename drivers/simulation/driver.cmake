set(driver_libraries drivers_laboratory)
set(driver_place 5)
