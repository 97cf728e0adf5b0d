/* Stub. */
#pragma once

void appMain(void);
