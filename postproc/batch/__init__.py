"""Many runs of commands: files x machines x controllers x options, in parallel, resumable."""
