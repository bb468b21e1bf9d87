# Checks that the tables of docs/internals/fidelity.md equal what PROGRAM measures. Its tests judge the figures.
execute_process(COMMAND ${PROGRAM} --gtest_filter=-RatedTorque.*:TextureTable.*:Print.*:FactoryGains.* --gtest_brief=1 --gtest_output=json:${OUT})
execute_process(COMMAND /usr/bin/python3 -B ${CHECK} ${OUT} ${PAGE} COMMAND_ERROR_IS_FATAL ANY)
