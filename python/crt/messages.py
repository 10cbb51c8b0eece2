"""The messages of libcrt go to the logger `crt`, which shows warnings and errors unless it is configured
otherwise."""

import logging

LOGGER = logging.getLogger("crt")
LEVELS = (logging.DEBUG, logging.INFO, logging.WARNING, logging.ERROR)


def tell(level, text):
    LOGGER.log(LEVELS[level], "%s", text)
