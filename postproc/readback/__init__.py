"""An own reader of G-code: text to words, words through the modal state to motion, motion against the CL file."""
